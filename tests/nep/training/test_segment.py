"""Sums, maxima and softmax over groups of rows, by hand."""

import numpy as np
import torch

from nep.training.segment import segment_max, segment_softmax, segment_sum


def test_segment_sum_and_softmax_by_hand():
    # rows 0 and 2 enter segment 1, row 1 enters segment 3; segments 0 and 2 are empty
    segment = torch.tensor([1, 3, 1])
    values = torch.tensor([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    assert segment_sum(values, segment, 4).tolist() == [[0, 0], [4, 40], [0, 0], [2, 20]]
    # softmax(0, log 3) = (1, 3) / 4, also when 1000 is added to both
    logits = torch.tensor([[0.0], [7.0], [float(np.log(3))]])
    want = torch.tensor([[0.25], [1.0], [0.75]])
    torch.testing.assert_close(segment_softmax(logits, segment, 4), want)
    torch.testing.assert_close(
        segment_softmax(logits + 1000, segment, 4), want, rtol=1e-4, atol=1e-4
    )


def test_segment_max_by_hand():
    values = torch.tensor([[1.0, -5.0], [3.0, -7.0], [-2.0, 0.5]])
    found = segment_max(values, torch.tensor([2, 2, 0]), 3)
    assert found.tolist() == [[-2.0, 0.5], [0.0, 0.0], [3.0, -5.0]]


def test_the_gradient_of_segment_max_goes_to_the_largest_rows():
    """Those that tie share it; a largest value of zero is one as any other."""
    values = torch.tensor([[1.0, 0.0], [2.0, -1.0], [2.0, -2.0], [5.0, 7.0]], requires_grad=True)
    found = segment_max(values, torch.tensor([0, 0, 0, 1]), 2)
    assert found.tolist() == [[2.0, 0.0], [5.0, 7.0]]
    (found * torch.tensor([[4.0, 3.0], [1.0, 2.0]])).sum().backward()
    assert values.grad.tolist() == [[0.0, 3.0], [2.0, 0.0], [2.0, 0.0], [1.0, 2.0]]

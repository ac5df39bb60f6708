"""Sums and softmax over groups of rows, by hand and against DGL."""

import numpy as np
import pytest
import torch

from nep.layers.segment import attend, segment_softmax, segment_sum


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


@pytest.mark.dgl
def test_attend_equals_dgl():
    import dgl

    generator = torch.Generator().manual_seed(0)
    source = torch.randint(30, (200,), generator=generator)
    segment = torch.randint(12, (200,), generator=generator) // 2 * 2  # every other one is empty
    values = torch.randn(30, 8, generator=generator, requires_grad=True)
    attention = torch.rand(200, 2, generator=generator, requires_grad=True)
    graph = dgl.heterograph(
        {("node", "to", "segment"): (source, segment)},
        num_nodes_dict={"node": 30, "segment": 12},
    )
    ours = attend(attention, values, source, segment, 12)
    theirs = dgl.ops.u_mul_e_sum(
        graph, values.unflatten(1, (2, 4)), attention.unsqueeze(2)
    ).flatten(1)
    torch.testing.assert_close(ours, theirs)
    weight = torch.randn(12, 8, generator=generator)
    for mine, other in zip(
        torch.autograd.grad(ours, [values, attention], weight),
        torch.autograd.grad(theirs, [values, attention], weight),
        strict=True,
    ):
        torch.testing.assert_close(mine, other, rtol=1e-4, atol=1e-5)

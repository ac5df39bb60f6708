"""Products and sums whose rows do not depend on what is beside them, to the last bit."""

import pytest
import torch

from nep.layers.equal_rows import Linear, apply_to_each, equal_rows, multiply, needs_equal_rows
from nep.layers.segment import segment_softmax, segment_sum
from nep.model.query_attention import QueryAttention

WIDTHS = [(7, 64), (64, 1), (93, 66), (128, 384), (512, 128)]


@pytest.mark.parametrize(("width", "columns"), WIDTHS)
def test_a_row_of_a_product_does_not_depend_on_the_others(width, columns):
    torch.manual_seed(0)
    rows, bias = torch.randn(300, width), torch.randn(columns)
    weight = torch.randn(columns, width).t() / width**0.5
    with equal_rows():
        whole = multiply(rows, weight, bias)
        for first, last in [(0, 1), (0, 32), (1, 2), (3, 70), (17, 300), (250, 299)]:
            assert torch.equal(multiply(rows[first:last], weight, bias), whole[first:last])
        assert multiply(rows[:0], weight, bias).shape == (0, columns)
    torch.testing.assert_close(whole, rows @ weight + bias)


def test_what_is_added_may_be_a_row_for_each_and_stays_as_it_is():
    torch.manual_seed(0)
    rows, weight, added = torch.randn(5, 7), torch.randn(7, 3), torch.randn(5, 3)
    before = added.clone()
    with equal_rows():
        torch.testing.assert_close(multiply(rows, weight, added), added + rows @ weight)
    assert torch.equal(added, before)


def test_a_linear_layer_is_that_of_torch():
    layer, values = Linear(9, 4), torch.randn(40, 9)
    assert torch.equal(layer(values), torch.nn.functional.linear(values, layer.weight, layer.bias))
    with equal_rows():
        torch.testing.assert_close(layer(values), values @ layer.weight.t() + layer.bias)


def test_a_sum_does_not_depend_on_the_order_of_rows():
    torch.manual_seed(0)
    values, segment = torch.randn(500, 8) * 100, torch.randint(7, (500,))
    order = torch.randperm(500)
    with equal_rows():
        total = segment_sum(values, segment, 8)
        assert torch.equal(segment_sum(values[order], segment[order], 8), total)
        share = segment_softmax(values, segment, 8)
        assert torch.equal(segment_softmax(values[order], segment[order], 8), share[order])
    assert total.dtype == share.dtype == torch.float32
    torch.testing.assert_close(total, segment_sum(values.double(), segment, 8).float())


def test_a_number_is_the_same_wherever_it_stands():
    values = torch.linspace(-5, 5, 101)
    with equal_rows():
        whole = apply_to_each(torch.sigmoid, values)
        for position, value in enumerate(values):
            assert apply_to_each(torch.sigmoid, value.view(1)) == whole[position]


def test_snapshots_of_any_size_attend_as_if_alone():
    torch.manual_seed(0)
    attention = QueryAttention(64, 2, 2, 128, 0.1).eval()
    sizes = [3, 40, 0, 31, 70, 1, 33]
    snapshot = torch.repeat_interleave(torch.arange(7), torch.tensor(sizes))
    order = torch.randperm(len(snapshot))
    query, snapshot = torch.randn(len(order), 64), snapshot[order]
    with torch.inference_mode(), equal_rows():
        whole = attention(query, snapshot, 7)
        for number in (0, 1, 3, 4, 5, 6):
            rows = snapshot == number
            alone = attention(query[rows], torch.zeros_like(snapshot[rows]), 1)
            assert torch.equal(alone, whole[rows])
    with torch.inference_mode():
        torch.testing.assert_close(whole, attention(query, snapshot, 7))


def test_it_ends_with_an_error():
    with pytest.raises(RuntimeError), equal_rows():
        multiply(torch.ones(2, 3), torch.ones(2, 3))
    assert not needs_equal_rows()

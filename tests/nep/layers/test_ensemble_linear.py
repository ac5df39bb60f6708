"""Layers of an ensemble: each member reads its own columns alone."""

import pytest
import torch
from torch import nn

from nep.layers.ensemble_linear import EnsembleLinear, gelu, make_linear, split_members


@pytest.mark.parametrize("bias", [True, False])
def test_members_are_linear_layers_side_by_side(bias):
    torch.manual_seed(0)
    both = EnsembleLinear(3, 5, 2, bias)
    values = torch.randn(7, 2, 3)
    found = both(values)
    assert found.shape == (7, 2, 5)
    for member in range(2):
        alone = nn.Linear(3, 5, bias)
        with torch.no_grad():
            alone.weight.copy_(both.weight[member].t())
            if bias:
                alone.bias.copy_(both.bias[member, 0])
        torch.testing.assert_close(found[:, member], alone(values[:, member]))


def test_it_begins_as_linear_layers_do():
    torch.manual_seed(0)
    layer = EnsembleLinear(16, 500, 3)
    for parameter in (layer.weight, layer.bias):
        assert parameter.abs().max() <= 1 / 4
        assert parameter.abs().max() > 0.24  # uniform up to 1 / sqrt(16)
        assert parameter.std(correction=0).item() == pytest.approx(0.25 / 3**0.5, rel=0.1)
    assert not torch.equal(layer.weight[0], layer.weight[1])


def test_a_single_network_has_plain_layers():
    assert isinstance(make_linear(3, 5, 1), nn.Linear)
    assert make_linear(3, 5, 1, bias=False).bias is None
    assert type(make_linear(3, 5, 2)) is EnsembleLinear


def test_columns_of_a_member_lie_together():
    values = torch.tensor([[10.0, 11.0, 20.0, 21.0]])
    assert split_members(values, 2).tolist() == [[[10, 11], [20, 21]]]
    assert split_members(values, 1) is values


def test_gelu_is_the_number_times_the_probability_of_a_smaller_one():
    """x Phi(x): 0 at 0; Phi(1) = .8413; -2 Phi(-2) = -2 x .0228 = -.0455; and up to 5e-4."""
    values = torch.tensor([0.0, 1.0, -2.0], dtype=torch.float64)
    expected = torch.tensor([0.0, 0.8413, -0.0455], dtype=torch.float64)
    torch.testing.assert_close(gelu(values), expected, rtol=0, atol=2e-4)
    values = torch.linspace(-10, 10, 2001, dtype=torch.float64)
    exact = values * torch.special.ndtr(values)
    assert (gelu(values) - exact).abs().max() < 5e-4

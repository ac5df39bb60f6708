"""Layers of an ensemble: each member reads its own columns alone."""

import pytest
import torch
from torch import nn

from nep.any_home.ensemble_linear import EnsembleLinear, SharedInput, gelu


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


def test_members_read_the_same_columns_with_their_own_weights():
    torch.manual_seed(0)
    both, values = SharedInput(4, 3, 2), torch.randn(5, 4)
    found = both(values)
    assert found.shape == (5, 2, 3)
    for member in range(2):
        first = torch.relu(both.first(values))[:, 3 * member : 3 * (member + 1)]
        second = first @ both.second.weight[member] + both.second.bias[member]
        torch.testing.assert_close(found[:, member], torch.relu(second))


def test_gelu_is_the_number_times_the_probability_of_a_smaller_one():
    """x Phi(x): 0 at 0; Phi(1) = .8413; -2 Phi(-2) = -2 x .0228 = -.0455; and up to 5e-4."""
    values = torch.tensor([0.0, 1.0, -2.0], dtype=torch.float64)
    expected = torch.tensor([0.0, 0.8413, -0.0455], dtype=torch.float64)
    torch.testing.assert_close(gelu(values), expected, rtol=0, atol=2e-4)
    values = torch.linspace(-10, 10, 2001, dtype=torch.float64)
    exact = values * torch.special.ndtr(values)
    assert (gelu(values) - exact).abs().max() < 5e-4

"""The activation in its form with a hyperbolic tangent."""

import torch

from nep.layers.ensemble_linear import gelu


def test_it_is_the_number_times_the_probability_of_a_smaller_one():
    """x Phi(x): 0 at 0; Phi(1) = .8413; -2 Phi(-2) = -2 x .0228 = -.0455; and up to 5e-4."""
    values = torch.tensor([0.0, 1.0, -2.0], dtype=torch.float64)
    expected = torch.tensor([0.0, 0.8413, -0.0455], dtype=torch.float64)
    torch.testing.assert_close(gelu(values), expected, rtol=0, atol=2e-4)
    values = torch.linspace(-10, 10, 2001, dtype=torch.float64)
    exact = values * torch.special.ndtr(values)
    assert (gelu(values) - exact).abs().max() < 5e-4

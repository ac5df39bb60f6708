"""Settings of a training: what would learn nothing is refused before it starts."""

import re

import pytest

from nep.any_home.any_home_module import AnyHomeModule
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule

NO_STEP = "learning_rate must be above 0, got 0.0: nothing would be learnt. Give a rate"


@pytest.mark.parametrize("make", [lambda **more: NEPModule(MLP(8), **more), AnyHomeModule])
def test_a_rate_of_zero_is_refused(make):
    with pytest.raises(ValueError, match=re.escape(NO_STEP)):
        make(learning_rate=0.0)
    make(learning_rate=1e-12)


@pytest.mark.parametrize("rate", [-0.1, float("nan")])
def test_a_rate_below_zero_is_refused(rate):
    with pytest.raises(ValueError, match="learning_rate must be at least 0, got"):
        NEPModule(MLP(8), learning_rate=rate)


def test_a_negative_weight_is_refused():
    with pytest.raises(ValueError, match=r"listwise_weight must be at least 0, got -0\.5"):
        NEPModule(MLP(8), listwise_weight=-0.5)

"""Settings of a training: what would learn nothing is refused before it starts."""

import re

import pytest

from nep.encoders import MLP
from nep.model.module import NEPModule
from nep.model.settings import LossConfig, OptimiserConfig

NO_LOSS = (
    "listwise_weight must be above 0 where paper_loss is off, got 0.0: nothing would be learnt. "
    "Give it a weight, or leave paper_loss on."
)
NO_STEP = "learning_rate must be above 0, got 0.0: nothing would be learnt. Give a rate"


@pytest.mark.parametrize("best", [False, True])
@pytest.mark.parametrize("weight", [0.0, -0.0])
def test_no_loss_at_all_is_refused(best, weight):
    with pytest.raises(
        ValueError, match=r"listwise_weight must be above 0 where paper_loss is off"
    ):
        LossConfig(paper_loss=False, listwise_weight=weight, listwise_best=best)


@pytest.mark.parametrize(("paper_loss", "weight"), [(True, 0.0), (False, 0.5), (True, 0.5)])
def test_either_loss_is_enough(paper_loss, weight):
    LossConfig(paper_loss=paper_loss, listwise_weight=weight)


def test_a_rate_of_zero_is_refused():
    with pytest.raises(ValueError, match=re.escape(NO_STEP)):
        OptimiserConfig(learning_rate=0.0)
    OptimiserConfig(learning_rate=1e-12)


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"paper_loss": False}, NO_LOSS), ({"learning_rate": 0.0}, NO_STEP)],
)
def test_a_network_is_not_made_with_them(settings, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        NEPModule(MLP(units=8), **settings)

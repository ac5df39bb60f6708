"""Play Predict Object Location with NEP-HEAT in homes in lockstep, untrained weights."""

from __future__ import annotations

from collections.abc import Callable

from _measure import run

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from nep.encoders import HEAT
from nep.module import NEPModule
from nep.policy import NEPPolicy
from simulator.config import HouseConfig
from simulator.evaluation import evaluate_policy
from simulator.prior_graph import PriorGraph
from simulator.streams import Streams


def prepare(tiny: bool) -> tuple[Callable[[], int], str]:
    """Make the policy."""
    num_houses, num_steps = (2, 3) if tiny else (20, 100)
    policy = NEPPolicy(NEPModule(HEAT()), GraphBuilder(FeatureConfig(), num_hops=1))
    prior = PriorGraph.default()

    def work() -> int:
        streams = Streams(0, "val", range(num_houses))
        evaluate_policy(lambda houses: policy, prior, HouseConfig(), streams, num_steps)
        return num_houses * num_steps

    return work, f"{num_houses} houses in lockstep x {num_steps} steps"


if __name__ == "__main__":
    run("evaluate NEP-HEAT online", "house-steps/s", prepare)

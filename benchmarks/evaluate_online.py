"""Play Predict Object Location with NEP-HEAT in homes in lockstep."""

from __future__ import annotations

from _measure import Benchmark, Measure, rate, run
from _network import make_policy

from simulator.config import HouseConfig
from simulator.evaluation import evaluate_policy
from simulator.prior_graph import PriorGraph
from simulator.streams import Streams


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Make the policy."""
    num_houses, num_steps = (2, 3) if tiny else (100, 30)
    policy, prior = make_policy(), PriorGraph.default()

    def work() -> int:
        streams = Streams(0, "val", range(num_houses))
        evaluate_policy(lambda houses: policy, prior, HouseConfig(), streams, num_steps)
        return num_houses * num_steps

    return rate(work), f"{num_houses} homes in lockstep x {num_steps} steps"


if __name__ == "__main__":
    benchmark = Benchmark("evaluate NEP-HEAT, predict location", "house-steps/s", goal=3_000)
    run(benchmark, prepare, repeats=3, uses_torch=True)

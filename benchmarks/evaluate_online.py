"""Play Predict Object Location with NEP-HEAT in homes in lockstep."""

from __future__ import annotations

from collections.abc import Callable

from _measure import Benchmark, Measure, rate, run
from _network import make_policy

from sgm.policies.policy import Policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def prepare(tiny: bool, make: Callable[[], Policy] = make_policy) -> tuple[Measure, str]:
    """Make the policy."""
    num_homes, num_steps = (2, 3) if tiny else (100, 30)
    policy = make()

    def work() -> int:
        streams = Streams(0, "val", range(num_homes))
        evaluate_policy(lambda homes: policy, SampledSource(), streams, num_steps)
        return num_homes * num_steps

    return rate(work), f"{num_homes} homes in lockstep x {num_steps} steps"


if __name__ == "__main__":
    benchmark = Benchmark("evaluate NEP-HEAT, predict location", "home-steps/s", goal=3_000)
    run(benchmark, prepare, repeats=3, uses_torch=True)

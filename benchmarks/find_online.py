"""Play Find Object with NEP-HEAT in homes in lockstep; homes that have found it wait.

The limit counts the arithmetic of the network alone, on one core: five episodes in 100 homes are
2,700 queries with 31,000 query edges, 115,000 nodes and 184,000 edges, 16.7 billion floating-point
operations at 75 a nanosecond, 0.22 s.
"""

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
    num_homes, num_episodes = (2, 2) if tiny else (100, 5)
    policy = make()

    def work() -> int:
        streams = Streams(0, "val", range(num_homes))
        evaluate_policy(
            lambda homes: policy, SampledSource(), streams, num_episodes, task="find_object"
        )
        return num_homes * num_episodes

    return rate(work), f"{num_homes} homes in lockstep x {num_episodes} episodes"


if __name__ == "__main__":
    benchmark = Benchmark("evaluate NEP-HEAT, find object", "episodes/s", goal=800, limit=2_270)
    run(benchmark, prepare, repeats=3, uses_torch=True)

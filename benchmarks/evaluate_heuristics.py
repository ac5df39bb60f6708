"""Play Predict Object Location with every heuristic: the figure is that of the slowest.

Homes are sampled anew for each of them, as an evaluation does. The filters, which are no
heuristics of the paper, are measured beside them.

Limit: the random numbers, as in collect.py without the disk: 2.3 us a home-step, 430,000
home-steps/s. A filter carries the belief about an object on from where it was last asked for: in
100 steps some 50 steps of belief a home-step, each 32 furniture nodes x 2 densities (3 for the
home filter) x 10 operations.
"""

from __future__ import annotations

import time

from _measure import Benchmark, Measure, run

from simulator.policies import POLICIES, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

FILTERS = ("prior_filter", "home_filter", "persistence", "adaptive", "ceiling")


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the size."""
    num_homes, num_steps = (2, 3) if tiny else (100, 100)

    def play(name: str) -> float:
        streams = Streams(0, "val", range(num_homes))
        start = time.perf_counter()
        evaluate_policy(lambda homes: make_policy(name, homes), SampledSource(), streams, num_steps)
        return num_homes * num_steps / (time.perf_counter() - start)

    def measure() -> tuple[float, dict[str, float]]:
        found = {name: play(name) for name in POLICIES}
        return min(figure for name, figure in found.items() if name not in FILTERS), found

    return measure, f"{num_homes} homes in lockstep x {num_steps} steps"


if __name__ == "__main__":
    benchmark = Benchmark("evaluate heuristics", "home-steps/s", goal=10_000, limit=430_000)
    run(benchmark, prepare, repeats=2)

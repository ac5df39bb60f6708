"""Homes with people evolve by hours: 192 objects at 32 furniture nodes, 2.5 residents on average.

Limit: not counted. A day of a home is some 80 events in the order of time, each of which takes or
puts back a few things, and two passes over 192 slots for each occasion that collects or tidies.
"""

from __future__ import annotations

from _measure import Benchmark, Measure, rate, run

from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Sample the homes."""
    num_homes, num_steps = (2, 3) if tiny else (200, 7 * 24)
    config = HomeConfig(dynamics=RoutineDynamics())
    homes = SampledHomes(PriorGraph.default(), config, Streams(0, "train", range(num_homes)))

    def work() -> int:
        for _ in range(num_steps):
            homes.evolve()
        return num_homes * num_steps

    return rate(work), f"{num_homes} homes in lockstep x {num_steps} hours, full size"


if __name__ == "__main__":
    run(Benchmark("evolve_routine", "home-steps/s", goal=30_000), prepare)

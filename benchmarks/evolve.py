"""Evolve homes: removals, moves and additions of 192 objects among 32 furniture nodes.

Limit: the random numbers. A home-step takes 201 numbers for removals, 201 for the race of the
movers, 11 for where they go and 108 for additions, one after the other: 521 of 2.5 ns, as each is a
product of 128 bits that waits for the one before. Two more are read for each of 5 objects that
come. Two are for each of the 7.7 weights of descriptions that are new to the home (2.7 a step among
the first hundred, 1 after five hundred): 25 pairs of 9.4 ns, a jump ahead each. 1.5 us in all:
650,000 home-steps/s if nothing else took any time. What else does is counted in README.md.
"""

from __future__ import annotations

from _measure import Benchmark, Measure, rate, run

from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Sample the homes."""
    num_homes, num_steps = (2, 3) if tiny else (500, 40)
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "train", range(num_homes)))

    def work() -> int:
        for _ in range(num_steps):
            homes.evolve()
        return num_homes * num_steps

    return rate(work), f"{num_homes} homes in lockstep x {num_steps} steps, full size"


if __name__ == "__main__":
    run(Benchmark("evolve", "home-steps/s", goal=200_000, limit=650_000), prepare)

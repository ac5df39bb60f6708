"""Evolve homes: removals, moves and additions of 192 objects among 32 furniture nodes."""

from __future__ import annotations

from collections.abc import Callable

from _measure import run

from simulator.config import HouseConfig
from simulator.dynamics import evolve
from simulator.houses import Houses
from simulator.prior_graph import PriorGraph
from simulator.streams import Streams


def prepare(tiny: bool) -> tuple[Callable[[], int], str]:
    """Sample the homes."""
    num_houses, num_steps = (2, 3) if tiny else (100, 100)
    streams = Streams(0, "train", range(num_houses))
    houses = Houses(PriorGraph.default(), HouseConfig(), streams)

    def work() -> int:
        for _ in range(num_steps):
            evolve(houses)
        return num_houses * num_steps

    return work, f"{num_houses} houses in lockstep, 192 objects, 32 furniture"


if __name__ == "__main__":
    run("evolve", "house-steps/s", prepare)

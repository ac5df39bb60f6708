"""The same decision through the public API: `memory.observe`, `ObjectFinder.rank`, with reasons.

One thread, whatever `--threads` says. The memory holds 200 objects at first and grows with looks;
every ranking names all candidate places, what was seen there and similar objects.
"""

from __future__ import annotations

import time

import numpy as np
from _measure import Benchmark, Measure, run
from _robot import Robot

from nep.robot.finder import ObjectFinder


def prepare(tiny: bool, source: str = "heat") -> tuple[Measure, str]:
    """Remember 200 objects; `source` names the network."""
    num_objects, num_decisions = (20, 3) if tiny else (200, 300)
    robot, finder = Robot(), ObjectFinder.load(source)
    robot.remember(num_objects)

    def measure() -> tuple[float, dict[str, float]]:
        seconds, choice = [], 0
        for _ in range(num_decisions):
            robot.evolve()
            seen, wish = robot.see(choice), robot.get_wish()
            start = time.perf_counter()
            robot.memory.observe(robot.furniture[choice], seen)
            places = finder.rank(robot.memory, wish)
            seconds.append(time.perf_counter() - start)
            choice = robot.furniture.index(places[0].furniture)
        milliseconds = np.sort(seconds) * 1000
        return float(np.median(milliseconds)), {"p99": float(np.quantile(milliseconds, 0.99))}

    return measure, f"{num_decisions} rankings in a home of 32 furniture and {num_objects} objects"


if __name__ == "__main__":
    benchmark = Benchmark("rank with ObjectFinder", "ms, median", 5, is_higher_better=False)
    run(benchmark, prepare, repeats=3, uses_torch=True, threads=1)

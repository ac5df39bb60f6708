"""Size of a saved memory of a home of 32 furniture nodes and 200 objects.

The limit counts what is in it: 200 objects x 7 columns and some 270 edges x 10 columns of 1 byte
each, and 200 descriptions of 20 letters. The file is a database that people can read: it has where
things are as a table, too, and some 35 kB are free pages of its tables.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from _measure import Benchmark, Measure, run
from _robot import Robot


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Remember 200 objects."""
    num_objects = 20 if tiny else 200
    robot = Robot()
    robot.remember(num_objects)

    def measure() -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "home.sgm"
            robot.memory.save(path)
            return path.stat().st_size / 1000, {}

    return (
        measure,
        f"32 furniture nodes, {num_objects} objects, {robot.memory.batch.edges.num_rows} edges",
    )


if __name__ == "__main__":
    benchmark = Benchmark("saved memory", "kB", goal=100, limit=8, is_higher_better=False)
    run(benchmark, prepare, repeats=1)

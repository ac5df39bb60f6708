"""Collect snapshots with the Bayesian policy in one process, written to disk.

Limit: the random numbers, as in evolve.py. A home reads 1,107 pairs for class noise, 7.7 for each
of its 170 descriptions at t = 0, and some 400 other numbers: 24 us, or 0.24 for each of 100
snapshots. A step takes 1.5 us to evolve, and 205 numbers of 2.5 ns to ask and look: 2.3 us a
snapshot. Its 1.4 KB take 2.8 us to hash (SHA-256, 500 MB/s) and 1 us to write: 160,000 snapshots/s.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

from _measure import Benchmark, Measure, run

from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the size."""
    config = (
        CollectConfig(num_homes=2, steps=3) if tiny else CollectConfig(num_homes=100, steps=100)
    )

    def measure() -> tuple[float, dict[str, float]]:
        folder = Path(tempfile.mkdtemp())
        start = time.perf_counter()
        collect(config, folder, progress=False)
        seconds = time.perf_counter() - start
        shutil.rmtree(folder)  # not timed
        return config.num_homes * config.steps / seconds, {}

    return measure, f"{config.num_homes} homes x {config.steps} steps, bayesian, on disk"


if __name__ == "__main__":
    run(Benchmark("collect", "snapshots/s", goal=5_000, limit=160_000), prepare)

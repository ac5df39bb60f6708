"""How many bytes of disk a snapshot takes, manifest included.

Limit: what a snapshot adds. A look changes or makes some 14 edges of 10 numbers, 4 objects of 7
and one furniture node of 5, each of 4 bytes (docs/data.md): 690 bytes. Its query has 64 prior
weights of 4 bytes, 32 answers of 1 byte and 2 numbers: 296 bytes. 0.99 KB; edges, nodes and layout,
once per home, add 7 numbers for each of some 300 edges and 200 objects: 0.1 KB for each of 100
snapshots.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from _measure import Benchmark, Measure, run

from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the size."""
    config = CollectConfig(num_homes=2, steps=3) if tiny else CollectConfig(num_homes=20, steps=100)

    def measure() -> tuple[float, dict[str, float]]:
        folder = Path(tempfile.mkdtemp())
        collect(config, folder, progress=False)
        size = sum(path.stat().st_size for path in folder.iterdir())
        shutil.rmtree(folder)
        return size / 1000 / (config.num_homes * config.steps), {}

    return measure, f"{config.num_homes} homes x {config.steps} steps, bayesian"


if __name__ == "__main__":
    benchmark = Benchmark("snapshot size", "KB on disk", 6, limit=1.1, is_higher_better=False)
    run(benchmark, prepare, repeats=1)

"""Turn snapshots on disk into batches for NEP-HEAT: masks, features, one DGL graph.

Milliseconds for each snapshot inside a batch of 100.

Limit: the numbers that a batch looks at and writes, at 1 ns each. It reads the ends of some 19,000
remembered and supposed edges and, twice, whether they are kept (80,000). It makes of the kept
8,000 pairs of nodes 9,700 edges of 9 features, 2 ends and the number of their pair (120,000) from
10 counters each (97,000). And it makes 6,900 nodes of 6 numbers
from 6 (83,000): 0.4 M numbers, 0.4 ms a
batch, 0.004 ms a snapshot. In bytes it writes 0.7 MB and reads 1.8 MB, 0.25 ms at 10 GB/s.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from _measure import Benchmark, Measure, run

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect the snapshots."""
    config = CollectConfig(num_homes=2, steps=5) if tiny else CollectConfig(num_homes=20, steps=100)
    batch_size, num_batches = (5, 1) if tiny else (100, 20)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), BatchBuilder(FeatureConfig(), num_hops=1))
    order = np.random.default_rng(0).integers(0, len(dataset), (num_batches, batch_size))
    dataset.__getitems__(order[0].tolist())

    def measure() -> tuple[float, dict[str, float]]:
        start = time.perf_counter()
        for indices in order:
            dataset.__getitems__(indices.tolist())
        return (time.perf_counter() - start) * 1000 / order.size, {}

    return measure, f"batches of {batch_size}, pruned to one hop"


if __name__ == "__main__":
    benchmark = Benchmark("build batch", "ms a snapshot", 0.05, limit=0.004, is_higher_better=False)
    run(benchmark, prepare, uses_torch=True)

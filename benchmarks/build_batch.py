"""Turn snapshots on disk into batches for NEP-HEAT: masks, features, one DGL graph."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from _measure import run

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from simulator.collect import CollectConfig, collect


def prepare(tiny: bool) -> tuple[Callable[[], int], str]:
    """Collect the snapshots."""
    config = CollectConfig(houses=2, steps=5) if tiny else CollectConfig(houses=20, steps=100)
    batch_size, num_batches = (5, 1) if tiny else (100, 20)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), GraphBuilder(FeatureConfig(), num_hops=1))
    order = np.random.default_rng(0).integers(0, len(dataset), (num_batches, batch_size))
    dataset.__getitems__(order[0].tolist())

    def work() -> int:
        for indices in order:
            dataset.__getitems__(indices.tolist())
        return order.size

    return work, f"batches of {batch_size}, pruned to one hop"


if __name__ == "__main__":
    run("build batch", "snapshots/s", prepare)

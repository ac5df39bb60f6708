"""Train NEP-HEAT on ready batches: forward, backward, Adam."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from _measure import run

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from nep.encoders import HEAT
from nep.flat_graph import FlatGraph
from nep.loss import balanced_bce
from nep.module import NEPModule
from simulator.collect import CollectConfig, collect


def prepare(tiny: bool) -> tuple[Callable[[], int], str]:
    """Collect snapshots and build batches."""
    config = CollectConfig(houses=2, steps=5) if tiny else CollectConfig(houses=20, steps=100)
    batch_size, num_batches = (5, 1) if tiny else (100, 10)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), GraphBuilder(FeatureConfig(), num_hops=1))
    order = np.random.default_rng(0).integers(0, len(dataset), (num_batches, batch_size))
    batches = [dataset.__getitems__(indices.tolist()) for indices in order]
    module = NEPModule(HEAT())
    optimiser = module.configure_optimizers()

    def work() -> int:
        for batch in batches:
            graph = FlatGraph.from_batch(batch)
            optimiser.zero_grad()
            balanced_bce(module.predictor.score(graph), graph.query_target).backward()
            optimiser.step()
        return order.size

    work()
    return work, f"batches of {batch_size}, pruned to one hop"


if __name__ == "__main__":
    run("train NEP-HEAT", "snapshots/s", prepare)

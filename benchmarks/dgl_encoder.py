"""HGT written with `dgl.nn.HGTConv` beside ours: forward and backward of one convolution.

How many times as long as `nep.encoders.HGT` it takes for a batch of 100 snapshots pruned to one
hop; `ms` and `ours_ms` are the two times. `ms_single` and `ours_ms_single` are the forward pass for
a single home, with the making of the DGL graph that only DGL's needs.

No limit is stated: both do the same products. What differs is what is written in between.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from _measure import Benchmark, Measure, run

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from nep.encoders import DGLHGT, HGT
from nep.encoders.encoder import Encoder
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect snapshots and make both encoders."""
    config = CollectConfig(num_homes=2, steps=5) if tiny else CollectConfig(num_homes=10, steps=100)
    size, repeats = (5, 1) if tiny else (100, 10)
    builder = GraphBuilder(FeatureConfig(), num_hops=1)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), builder)
    order = np.random.default_rng(0).permutation(len(dataset))[:size]
    batch = dataset.__getitems__(order.tolist())
    single = dataset.snapshots.take(order[:1])
    node, single_node = (
        torch.randn(batch.num_nodes, 64),
        torch.randn(builder.build(single).num_nodes, 64),
    )
    dgl_encoder, our_encoder = DGLHGT(), HGT()

    def train(encoder: Encoder) -> None:
        encoder(batch, node, None).sum().backward()

    def play(encoder: Encoder) -> None:
        with torch.inference_mode():
            encoder(builder.build(single), single_node, None)

    def measure() -> tuple[float, dict[str, float]]:
        theirs, ours = (_time(train, each, repeats) for each in (dgl_encoder, our_encoder))
        theirs_single, ours_single = (
            _time(play, each, 10 * repeats) for each in (dgl_encoder, our_encoder)
        )
        return theirs / ours, {
            "ms": theirs,
            "ours_ms": ours,
            "ms_single": theirs_single,
            "ours_ms_single": ours_single,
        }

    return measure, f"{size} snapshots, {batch.num_nodes} nodes, {batch.num_edges} edges"


def _time(work: Callable[[Encoder], None], encoder: Encoder, repeats: int) -> float:
    """Return the shortest processor time in milliseconds."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work(encoder)
        times.append(time.process_time() - start)
    return 1000 * min(times)


if __name__ == "__main__":
    run(
        Benchmark("HGT by dgl.nn", "times ours", 2, is_higher_better=False),
        prepare,
        uses_torch=True,
    )

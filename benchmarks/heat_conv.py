"""One HEAT layer forwards and backwards on DGL, beside the stand-in's and PyTorch Geometric's.

Milliseconds for a batch of 100 snapshots, pruned to one hop: some N = 6,900 nodes, E = 9,700 edges
into R = 1,000 of them; D = 64 units, one head, A = 16 units of an edge's attributes. The graph is
there, as it is in training, where the loader makes it once a batch; `graph` says how long that
takes, with DGL's sparse formats.

`stand_in_ratio` says how much longer the same layer takes without DGL, and `hgt_ratio` how much
longer DGL's own layer for typed graphs does, `dgl.nn.HGTConv` with two heads. Where PyTorch
Geometric is installed (extra `bench`), its `HEATConv` runs beside ours with equal weights
(`pyg_forward`, `pyg_backward`), and it is an error if any output or gradient differs by more than
1e-10 in float64.

Limit: the matrix products, twice two operations a multiplication for the two gradients of each,
take 3 x 2 x (2 N D D + E D A + R A D) = 3 x 2 x (57 + 9.9 + 1.0) M = 407 M operations forwards and
backwards: 2.5 ms on 2 cores that do 83 G a second each (8 numbers, 2 units, 2 operations, 2.6 GHz).
The rest reads or writes some 15 arrays of E D or N D numbers, 33 MB, which the caches hold.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import torch
from _measure import Benchmark, Measure, run
from torch import Tensor, nn

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from datamodules.dgl_stand_in import GraphStandIn
from datamodules.feature_config import FeatureConfig
from datamodules.message_passing import make_graph
from datamodules.snapshot_loader import SnapshotDataset
from nep.paper.encoders.heat import HEATConv
from nep.paper.encoders.hgt import ReluHGTConv
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig

UNITS = 64
_TOLERANCE = 1e-10  # of float64


def make_layer(heads: int = 1) -> HEATConv:
    """Make a layer of the sizes of `heat.yaml`."""
    torch.manual_seed(0)
    return HEATConv((UNITS, UNITS, UNITS), heads)


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect a batch, and compare the layers if there are two."""
    config = CollectConfig(num_homes=2, steps=5) if tiny else CollectConfig(num_homes=20, steps=100)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), BatchBuilder(FeatureConfig(), num_hops=1))
    order = np.random.default_rng(0).permutation(len(dataset))
    batch = dataset.__getitems__(order[: 5 if tiny else 100].tolist())
    torch.manual_seed(0)
    node, edge = (
        torch.randn(count, UNITS).requires_grad_() for count in (batch.num_nodes, batch.num_edges)
    )
    stand_in = GraphStandIn(batch.edge_src, batch.edge_dst, batch.num_nodes)
    stand_in.ndata["_TYPE"], stand_in.edata["_TYPE"] = batch.node_type, batch.edge_type
    heat, hgt = make_layer(), ReluHGTConv(UNITS, 2)
    works = {
        "dgl": (partial(heat, batch.homogeneous, node, edge), [node, edge, *heat.parameters()]),
        "stand_in": (partial(heat, stand_in, node, edge), [node, edge, *heat.parameters()]),
        "hgt": (partial(hgt, batch.homogeneous, node), [node, *hgt.parameters()]),
    }
    try:
        beside = f"beside PyTorch Geometric {version('torch_geometric')}"
    except PackageNotFoundError:
        beside = "PyTorch Geometric is not installed (extra `bench`)"
    else:
        theirs = _make_theirs(batch, node, edge)
        works["pyg"] = (partial(theirs, batch, node, edge), [node, edge, *theirs.parameters()])
    repeats = 1 if tiny else 10

    def measure() -> tuple[float, dict[str, float]]:
        seconds = time_in_turn(works, repeats)
        ours = seconds["dgl"]
        figures = {"forward": ours[0] * 1000, "backward": ours[1] * 1000}
        for name in ("stand_in", "hgt"):
            figures[f"{name}_ratio"] = sum(seconds[name]) / sum(ours)
        if "pyg" in seconds:
            for way, part in enumerate(("forward", "backward")):
                figures[f"pyg_{part}"] = seconds["pyg"][way] / ours[way]
        start = time.perf_counter()
        make_graph(batch.edge_src, batch.edge_dst, batch.num_nodes).create_formats_()
        figures["graph"] = (time.perf_counter() - start) * 1000
        return sum(ours) * 1000, figures

    return measure, f"{batch.num_nodes} nodes, {batch.num_edges} edges, {UNITS} units; {beside}"


def _make_theirs(batch: Batch, node: Tensor, edge: Tensor) -> nn.Module:
    """Make their layer with the weights of ours.

    Raises:
        RuntimeError: if theirs gives something else, with one head or two.
    """
    from _pyg import PyGLayer, compute_difference  # here, since it need not be installed

    for heads in (1, 2):
        difference = compute_difference(make_layer(heads), batch, node, edge)
        if difference > _TOLERANCE:
            raise RuntimeError(
                f"layers must differ by at most {_TOLERANCE}, got {difference} with {heads} heads. "
                "Find out which of them is right."
            )
    return PyGLayer(make_layer())


def time_in_turn(
    works: dict[str, tuple[Callable[[], Tensor], list[Tensor]]], repeats: int
) -> dict[str, tuple[float, float]]:
    """Return the seconds that each work takes forwards and backwards, each the best of some.

    Args:
        works: by name, what to call and what to take gradients of.
        repeats: how often.
    """
    best = {name: (math.inf, math.inf) for name in works}
    for _ in range(repeats):
        for name, (work, inputs) in works.items():
            start = time.perf_counter()
            out = work()
            middle = time.perf_counter()
            torch.autograd.grad(out.sum(), inputs)
            end = time.perf_counter()
            best[name] = (min(best[name][0], middle - start), min(best[name][1], end - middle))
    return best


if __name__ == "__main__":
    benchmark = Benchmark("HEAT layer", "ms", 10, limit=2.5, is_higher_better=False)
    run(benchmark, prepare, repeats=3, uses_torch=True)

"""One HEAT layer forwards and backwards, beside PyTorch Geometric's and beside DGL's kernel.

Milliseconds for a batch of 100 snapshots, pruned to one hop: some N = 6,900 nodes, E = 9,700 edges
into R = 1,000 of them; D = 64 units, K heads, A = 16 units of an edge's attributes.

Where PyTorch Geometric is installed (extra `bench`), its `HEATConv` runs beside ours with equal
weights, and it is an error if any output or gradient differs by more than 1e-10 in float64. With
one head both are the same function, and `pyg_*` compares that. With two, theirs works on twice the
width (`_pyg.py`), and its output holds ours: `pyg_heads_*`. Ratios above 1 say how much longer
theirs takes. `dgl_ratio` does so for the attention-weighted sum alone, `dgl.ops.u_mul_e_sum` for
`nep.training.segment.attend`.

Limit: the matrix products, twice two operations a multiplication for the two gradients of each,
take 3 x 2 x (N D (D + 2 K) + E D A + R K A D / K) = 3 x 2 x (30.0 + 9.9 + 1.0) M = 245 M operations
forwards and backwards: 1.5 ms on 2 cores that do 83 G a second each (8 numbers, 2 units, 2
operations, 2.6 GHz). The rest reads or writes some 15 arrays of E D or N D numbers, 33 MB, which
the caches hold.
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
from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from nep.paper.encoders.heat import HEATConv
from nep.training.segment import attend
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig

UNITS = 64
_TOLERANCE = 1e-10  # of float64


def make_layer(heads: int) -> HEATConv:
    """Make a layer of the sizes of `heat.yaml`."""
    torch.manual_seed(0)
    return HEATConv(UNITS, UNITS, UNITS, heads, edge_type_units=16, edge_attribute_units=16)


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect a batch, and compare the layers if there are two."""
    config = CollectConfig(num_homes=2, steps=5) if tiny else CollectConfig(num_homes=20, steps=100)
    with tempfile.TemporaryDirectory() as folder:
        collect(config, Path(folder), progress=False)
        dataset = SnapshotDataset(Path(folder), GraphBuilder(FeatureConfig(), num_hops=1))
    order = np.random.default_rng(0).permutation(len(dataset))
    batch = dataset.__getitems__(order[: 5 if tiny else 100].tolist())
    torch.manual_seed(0)
    node, edge = (
        torch.randn(count, UNITS).requires_grad_() for count in (batch.num_nodes, batch.num_edges)
    )
    layers: dict[str, nn.Module] = {"ours": make_layer(2)}
    try:
        beside = f"beside PyTorch Geometric {version('torch_geometric')}"
    except PackageNotFoundError:
        beside = "PyTorch Geometric is not installed (extra `bench`)"
    else:
        layers |= _make_theirs(batch, node, edge)
    repeats = 1 if tiny else 10

    def measure() -> tuple[float, dict[str, float]]:
        seconds = time_in_turn(
            {
                name: (partial(layer, batch, node, edge), [node, edge, *layer.parameters()])
                for name, layer in layers.items()
            },
            repeats,
        )
        figures = {"forward": seconds["ours"][0] * 1000, "backward": seconds["ours"][1] * 1000}
        for name, ours, theirs in (("pyg", "one", "pyg_one"), ("pyg_heads", "ours", "pyg_two")):
            if theirs in seconds:
                for way, part in enumerate(("forward", "backward")):
                    figures[f"{name}_{part}"] = seconds[theirs][way] / seconds[ours][way]
        figures["dgl_ratio"] = compare_dgl(batch, node, repeats)
        return sum(seconds["ours"]) * 1000, figures

    size = f"{batch.num_nodes} nodes, {batch.num_edges} edges, {UNITS} units, 2 heads; {beside}"
    return measure, size


def _make_theirs(batch: Batch, node: Tensor, edge: Tensor) -> dict[str, nn.Module]:
    """Make layers of both with one head, and theirs with two.

    Raises:
        RuntimeError: if theirs gives something else.
    """
    from _pyg import PyGLayer, compute_difference  # here, since it need not be installed

    for heads in (1, 2):
        difference = compute_difference(make_layer(heads), batch, node, edge)
        if difference > _TOLERANCE:
            raise RuntimeError(
                f"layers must differ by at most {_TOLERANCE}, got {difference} with {heads} heads. "
                "Find out which of them is right."
            )
    layer = make_layer(1)
    return {"one": layer, "pyg_one": PyGLayer(layer), "pyg_two": PyGLayer(make_layer(2))}


def compare_dgl(batch: Batch, node: Tensor, repeats: int) -> float:
    """Divide the time of DGL's kernel by that of `attend`, forwards and backwards."""
    import dgl  # after `datamodules`, without which it writes a file into the user's home

    entered, entry = batch.find_entered()
    values = node.detach().requires_grad_()
    attention = torch.rand(batch.num_edges, 2, requires_grad=True)
    bipartite = dgl.heterograph(
        {("node", "to", "entered"): (batch.edge_src, entry)},
        num_nodes_dict={"node": batch.num_nodes, "entered": len(entered)},
    )
    kernels: dict[str, Callable[[], Tensor]] = {
        "ours": lambda: attend(attention, values, batch.edge_src, entry, len(entered)),
        "dgl": lambda: dgl.ops.u_mul_e_sum(
            bipartite, values.unflatten(1, (2, -1)), attention.unsqueeze(2)
        ),
    }
    inputs = [values, attention]
    seconds = time_in_turn({name: (work, inputs) for name, work in kernels.items()}, repeats)
    return sum(seconds["dgl"]) / sum(seconds["ours"])


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
    benchmark = Benchmark("HEAT layer", "ms", 10, limit=1.5, is_higher_better=False)
    run(benchmark, prepare, repeats=3, uses_torch=True)

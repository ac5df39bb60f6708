"""What encoders are written with: DGL's graphs, functions and layers, or a stand-in's.

DGL has wheels up to Python 3.11, and those on PyPI know the CPU alone. Where it does not install,
or was not built for the device, `datamodules.dgl_stand_in` has the same few calls.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import torch
from torch import Tensor

from datamodules.dgl_stand_in import GraphStandIn

try:
    import dgl
    from dgl import function as fn
    from dgl.nn import GraphConv, HGTConv
except ModuleNotFoundError as error:
    if error.name != "dgl":
        raise
    from datamodules import dgl_stand_in as fn
    from datamodules.dgl_stand_in_layers import GraphConv, HGTConv

    dgl = None

__all__ = ["ETYPE", "NTYPE", "GraphConv", "HGTConv", "edge_softmax", "fn", "make_graph"]
NTYPE = ETYPE = "_TYPE"  # DGL's columns of the type ids of a homogeneous view


def make_graph(src: Tensor, dst: Tensor, num_src: int, num_dst: int | None = None) -> Any:
    """Make a homogeneous graph of edges (E,), (E,), or a bipartite one.

    Args:
        src: ids of the sources, int64 (E,).
        dst: ids of the destinations, int64 (E,).
        num_src: number of nodes, or of sources.
        num_dst: number of destinations, if these are other nodes (in DGL, a block).

    Returns:
        A `dgl.DGLGraph` or a `GraphStandIn`.
    """
    if not _knows(src.device.type):
        return GraphStandIn(src, dst, num_src, num_dst)
    ends = src.int(), dst.int()
    if num_dst is None:
        return dgl.graph(ends, num_nodes=num_src)
    return dgl.create_block(ends, num_src, num_dst)


def edge_softmax(graph: Any, logits: Tensor) -> Tensor:
    """Softmax over the edges that enter each node, each column on its own: (E, ...)."""
    if isinstance(graph, GraphStandIn):
        return graph.softmax(logits)
    found: Tensor = dgl.ops.edge_softmax(graph, logits)
    return found


@lru_cache
def _knows(device: str) -> bool:
    """Tell whether DGL is there, and was built for a kind of device."""
    if dgl is None:
        return False
    try:
        dgl.graph(([], []), device=torch.device(device))
    except (dgl.DGLError, LookupError, RuntimeError, TypeError):
        return False
    return True

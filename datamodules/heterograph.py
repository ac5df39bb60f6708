"""A batch by node and edge type, as graph libraries hold it; DGL and PyTorch Geometric."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from sgm.schema import EDGE_TYPES, NODE_TYPES

if TYPE_CHECKING:
    import dgl
    from torch_geometric.data import HeteroData

EdgeType = tuple[str, str, str]


@dataclass(frozen=True)
class Heterograph:
    """Nodes and edges of a batch by type; ids of nodes count from 0 in each type.

    Attributes:
        node_counts: number of nodes of each node type.
        ends: sources and destinations of each edge type, (n,) each.
        node_data: columns of each node type, (n, ...) each.
        edge_data: columns of each edge type, (n, ...) each.
        num_snapshots: B.
    """

    node_counts: Mapping[str, int]
    ends: Mapping[EdgeType, tuple[Tensor, Tensor]]
    node_data: Mapping[str, Mapping[str, Tensor]]
    edge_data: Mapping[EdgeType, Mapping[str, Tensor]]
    num_snapshots: int

    @classmethod
    def from_dgl(cls, graph: dgl.DGLGraph, num_snapshots: int) -> Heterograph:
        """Take nodes, edges and their data from a DGL graph."""
        _check_types(graph.ntypes, graph.canonical_etypes)
        return cls(
            {ntype: graph.num_nodes(ntype) for ntype in NODE_TYPES},
            {etype: graph.edges(etype=etype, order="eid") for etype in EDGE_TYPES},
            {ntype: graph.nodes[ntype].data for ntype in NODE_TYPES},
            {etype: graph.edges[etype].data for etype in EDGE_TYPES},
            num_snapshots,
        )

    @classmethod
    def from_pyg(cls, graph: HeteroData, num_snapshots: int) -> Heterograph:
        """Take nodes, edges and their data from PyTorch Geometric's graph."""
        _check_types(graph.node_types, graph.edge_types)
        return cls(
            {ntype: graph[ntype].num_nodes for ntype in NODE_TYPES},
            {etype: tuple(graph[etype].edge_index) for etype in EDGE_TYPES},
            {ntype: graph[ntype] for ntype in NODE_TYPES},
            {etype: graph[etype] for etype in EDGE_TYPES},
            num_snapshots,
        )

    def to_dgl(self) -> dgl.DGLGraph:
        """Make a DGL graph that knows its snapshots, as one of `dgl.batch` does.

        Raises:
            ModuleNotFoundError: if DGL is not installed.
        """
        dgl = import_dgl("batch.graph", "batch.to_pyg() gives the same graph without it.")
        graph = dgl.heterograph(dict(self.ends), num_nodes_dict=dict(self.node_counts))
        for ntype, columns in self.node_data.items():
            graph.nodes[ntype].data.update(columns)
        for etype, columns in self.edge_data.items():
            graph.edges[etype].data.update(columns)
        snapshot = {ntype: columns["snapshot"] for ntype, columns in self.node_data.items()}
        count = partial(torch.bincount, minlength=self.num_snapshots)
        graph.set_batch_num_nodes({ntype: count(found) for ntype, found in snapshot.items()})
        graph.set_batch_num_edges(
            {etype: count(snapshot[etype[2]][dst.long()]) for etype, (_, dst) in self.ends.items()}
        )
        return graph

    def to_pyg(self) -> HeteroData:
        """Make PyTorch Geometric's `HeteroData`.

        Raises:
            ModuleNotFoundError: if torch_geometric is not installed.
        """
        data = import_pyg("batch.to_pyg()").HeteroData()
        for ntype, columns in self.node_data.items():
            data[ntype].update(columns)
            data[ntype].update(num_nodes=self.node_counts[ntype], batch=columns["snapshot"])
        for etype, ends in self.ends.items():
            data[etype].update(self.edge_data[etype])
            data[etype].edge_index = torch.stack(ends)
        return data


def import_dgl(what: str, instead: str) -> Any:
    """Return the package `dgl`.

    Args:
        what: what needs it, for the message.
        instead: what serves without it.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    try:
        return import_module("dgl")
    except ModuleNotFoundError as error:
        if error.name != "dgl":
            raise
        raise ModuleNotFoundError(
            f"{what} must have DGL, got none. Its wheels end with Python 3.11: "
            f"pip install 'dgl>=1.1.3,<2' there. {instead}",
            name="dgl",
        ) from error


def import_pyg(what: str) -> Any:
    """Return `torch_geometric.data`.

    Args:
        what: what needs it, for the message.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    try:
        return import_module("torch_geometric.data")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{what} must have torch_geometric, got none. "
            "Install it with `pip install ./core '.[events]'`."
        ) from error


def _check_types(node_types: Any, edge_types: Any) -> None:
    for what, want, got in (
        ("node types", NODE_TYPES, node_types),
        ("edge types", EDGE_TYPES, edge_types),
    ):
        if set(got) != set(want):
            raise ValueError(
                f"{what} of a batch must be {sorted(want)}, got {sorted(got)}. "
                "Give the graph the full schema, empty types included."
            )

"""Batches as graphs of DGL and PyTorch Geometric."""

from __future__ import annotations

from collections.abc import Mapping
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


Data = Mapping[Any, Mapping[str, Tensor]]  # columns by node or edge type
Ends = Mapping[EdgeType, tuple[Tensor, Tensor]]  # ids count from 0 in each node type


def make_dgl(node_data: Data, edge_data: Data, ends: Ends, num_snapshots: int) -> dgl.DGLGraph:
    """Make a DGL graph that knows its snapshots, as one of `dgl.batch` does.

    Nodes have `label` and `snapshot`, at least.

    Raises:
        ModuleNotFoundError: if DGL is not installed.
    """
    dgl = import_dgl("batch.graph", "batch.to_pyg() gives the same graph without it.")
    counts = {ntype: len(columns["label"]) for ntype, columns in node_data.items()}
    graph = dgl.heterograph(dict(ends), num_nodes_dict=counts)
    for ntype, columns in node_data.items():
        graph.nodes[ntype].data.update(columns)
    for etype, columns in edge_data.items():
        graph.edges[etype].data.update(columns)
    snapshot = {ntype: columns["snapshot"] for ntype, columns in node_data.items()}
    count = partial(torch.bincount, minlength=num_snapshots)
    graph.set_batch_num_nodes({ntype: count(found) for ntype, found in snapshot.items()})
    graph.set_batch_num_edges(
        {etype: count(snapshot[etype[2]][dst.long()]) for etype, (_, dst) in ends.items()}
    )
    return graph


def make_pyg(node_data: Data, edge_data: Data, ends: Ends) -> HeteroData:
    """Make PyTorch Geometric's `HeteroData`; nodes have `label` and `snapshot`, at least.

    Raises:
        ModuleNotFoundError: if torch_geometric is not installed.
    """
    data = import_pyg("batch.to_pyg()").HeteroData()
    for ntype, columns in node_data.items():
        data[ntype].update(columns)
        data[ntype].update(num_nodes=len(columns["label"]), batch=columns["snapshot"])
    for etype, columns in edge_data.items():
        data[etype].update(columns)
        data[etype].edge_index = torch.stack(ends[etype])
    return data


def is_dgl(graph: dgl.DGLGraph | HeteroData) -> bool:
    """Tell DGL's graphs from those of PyTorch Geometric, without either library."""
    return hasattr(graph, "canonical_etypes")


def read_graph(graph: dgl.DGLGraph | HeteroData) -> tuple[Data, Data, Ends]:
    """Return the data of nodes and edges, and the two ends of edges, all by type.

    Raises:
        ValueError: if the graph's node or edge types are not those of the schema.
    """
    if is_dgl(graph):
        _check_types(graph.ntypes, graph.canonical_etypes)
        return (
            {ntype: graph.nodes[ntype].data for ntype in NODE_TYPES},
            {etype: graph.edges[etype].data for etype in EDGE_TYPES},
            {etype: graph.edges(etype=etype, order="eid") for etype in EDGE_TYPES},
        )
    _check_types(graph.node_types, graph.edge_types)
    return (
        {ntype: graph[ntype] for ntype in NODE_TYPES},
        {etype: graph[etype] for etype in EDGE_TYPES},
        {etype: tuple(graph[etype].edge_index) for etype in EDGE_TYPES},
    )


def import_dgl(noun: str, instead: str) -> Any:
    """Return the package `dgl`.

    Args:
        noun: what needs it, for the message.
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
            f"{noun} must have DGL, got none. Its wheels end with Python 3.11: "
            f"pip install 'dgl>=1.1.3,<2' there. {instead}",
            name="dgl",
        ) from error


def import_pyg(noun: str) -> Any:
    """Return `torch_geometric.data`.

    Args:
        noun: what needs it, for the message.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    try:
        return import_module("torch_geometric.data")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{noun} must have torch_geometric, got none. "
            "Install it with `pip install ./core '.[events]'`."
        ) from error


def _check_types(node_types: Any, edge_types: Any) -> None:
    for noun, want, got in (
        ("node types", NODE_TYPES, node_types),
        ("edge types", EDGE_TYPES, edge_types),
    ):
        if set(got) != set(want):
            raise ValueError(
                f"{noun} of a batch must be {sorted(want)}, got {sorted(got)}. "
                "Give the graph the full schema, empty types included."
            )

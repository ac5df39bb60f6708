"""Batches from graphs of DGL or PyTorch Geometric, such as an edited one."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from datamodules.batch import Batch
from datamodules.graph_columns import (
    FURNITURE_DATA,
    NODE_DATA,
    QUERY_DATA,
    Data,
    Ends,
)
from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

if TYPE_CHECKING:
    import dgl
    from torch_geometric.data import HeteroData

_OPTIONAL = ("evidence", "relevance")


def read_batch(
    graph: dgl.DGLGraph | HeteroData,
    text: Tensor,
    num_snapshots: int,
    question: Tensor | None = None,
) -> Batch:
    """Take a batch from a graph, as `Batch.graph` and `Batch.to_pyg` make it.

    Raises:
        ValueError: if the graph's node or edge types are not those of the schema.
    """
    nodes, edges, ends = _read_graph(graph)
    node_counts = tuple(len(nodes[ntype]["label"]) for ntype in NODE_TYPES)
    edge_counts = tuple(len(ends[etype][0]) for etype in EDGE_TYPES)
    first_node = dict(zip(NODE_TYPES, accumulate(node_counts, initial=0), strict=False))
    first_edge = dict(zip(EDGE_TYPES, accumulate(edge_counts, initial=0), strict=False))
    src, dst = (
        torch.cat([ends[etype][n].long() + first_node[etype[2 * n]] for etype in EDGE_TYPES])
        for n in (0, 1)
    )
    marked = {etype: (edges[etype]["query"] >= 0).nonzero()[:, 0] for etype in QUERY_EDGE_TYPES}
    columns: dict[str, Any] = {
        field: torch.cat([nodes[ntype][name] for ntype in NODE_TYPES])
        for name, field in NODE_DATA.items()
    }
    columns |= {
        field: nodes["furniture"][name]
        for name, field in FURNITURE_DATA.items()
        if name not in _OPTIONAL or name in nodes["furniture"]
    }
    for name, (field, _) in QUERY_DATA.items():
        if name not in _OPTIONAL or all(name in edges[etype] for etype in marked):
            columns[field] = torch.cat([edges[e][name][rows] for e, rows in marked.items()])
    batch = Batch(
        node_counts=node_counts,
        edge_counts=edge_counts,
        edge_src=src,
        edge_dst=dst,
        edge_feature=torch.cat([edges[etype]["feature"] for etype in EDGE_TYPES]),
        query_edge=torch.cat([rows + first_edge[etype] for etype, rows in marked.items()]),
        question=question,
        text=text,
        num_snapshots=num_snapshots,
        **{"evidence": None, "query_relevance": None, **columns},
    )
    if _is_dgl(graph):
        batch.__dict__["graph"] = graph
    return batch


def _is_dgl(graph: Any) -> bool:
    """Tell DGL's graphs from those of PyTorch Geometric, without either library."""
    return hasattr(graph, "canonical_etypes")


def _read_graph(graph: Any) -> tuple[Data, Data, Ends]:
    """Return the data of nodes and edges, and the two ends of edges, all by type."""
    if _is_dgl(graph):
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

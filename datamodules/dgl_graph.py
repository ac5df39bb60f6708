"""A heterogeneous DGL graph of the arrays of a batch, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import accumulate
from typing import Any, TypeVar

import dgl
import torch
from torch import Tensor

from simulator.snapshots.graph import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

_Type = TypeVar("_Type", str, tuple[str, str, str])


def make_graph(
    node_counts: tuple[int, ...],
    edge_counts: tuple[int, ...],
    ends: tuple[Tensor, Tensor],
    num_snapshots: int,
    node_data: Mapping[str, Tensor],
    edge_data: Mapping[str, Tensor],
) -> dgl.DGLGraph:
    """Make a graph that knows its snapshots.

    Args:
        node_counts: nodes of each type.
        edge_counts: edges of each type.
        ends: source and destination of each edge, int64 (E,), among all nodes.
        num_snapshots: B.
        node_data: columns of all nodes, (N, ...); `snapshot` is the snapshot of each.
        edge_data: columns of all edges, (E, ...).
    """
    first_node = dict(zip(NODE_TYPES, accumulate(node_counts, initial=0), strict=False))
    sources, destinations = (end.split(edge_counts) for end in ends)
    graph = dgl.heterograph(
        {
            (src, name, dst): (source - first_node[src], destination - first_node[dst])
            for (src, name, dst), source, destination in zip(
                EDGE_TYPES, sources, destinations, strict=True
            )
        },
        num_nodes_dict=dict(zip(NODE_TYPES, node_counts, strict=True)),
    )
    for name, values in node_data.items():
        for ntype, part in zip(NODE_TYPES, values.split(node_counts), strict=True):
            graph.nodes[ntype].data[name] = part
    for name, values in edge_data.items():
        for etype, part in zip(EDGE_TYPES, values.split(edge_counts), strict=True):
            graph.edges[etype].data[name] = part
    snapshot = node_data["snapshot"]
    graph.set_batch_num_nodes(_count(NODE_TYPES, snapshot.split(node_counts), num_snapshots))
    of_edges = snapshot[ends[1]].split(edge_counts)
    graph.set_batch_num_edges(_count(EDGE_TYPES, of_edges, num_snapshots))
    return graph


def _count(
    types: Iterable[_Type], parts: Iterable[Tensor], num_snapshots: int
) -> dict[_Type, Tensor]:
    """Count the entries of each type and snapshot: (B,) by type."""
    counts = (part.bincount(minlength=num_snapshots) for part in parts)
    return dict(zip(types, counts, strict=True))


def read_graph(graph: dgl.DGLGraph) -> dict[str, Any]:
    """Return what a DGL graph says of the attributes of a `Batch`.

    Raises:
        ValueError: if the graph's node or edge types are not those of the schema.
    """
    for what, want, got in (
        ("node types", NODE_TYPES, graph.ntypes),
        ("edge types", EDGE_TYPES, graph.canonical_etypes),
    ):
        if set(got) != set(want):
            raise ValueError(
                f"{what} of a batch must be {sorted(want)}, got {sorted(got)}. "
                "Give the graph the full schema, empty types included."
            )
    node_counts = tuple(graph.num_nodes(ntype) for ntype in NODE_TYPES)
    edge_counts = tuple(graph.num_edges(etype) for etype in EDGE_TYPES)
    first_node = dict(zip(NODE_TYPES, accumulate(node_counts, initial=0), strict=False))
    first_edge = dict(zip(EDGE_TYPES, accumulate(edge_counts, initial=0), strict=False))
    ends = [
        [
            end.long() + first_node[ntype]
            for end, ntype in zip(graph.edges(etype=etype, order="eid"), etype[::2], strict=True)
        ]
        for etype in EDGE_TYPES
    ]
    queries = {etype: graph.edges[etype].data for etype in QUERY_EDGE_TYPES}
    marked = {etype: torch.nonzero(data["query"] >= 0)[:, 0] for etype, data in queries.items()}
    has_relevance = all("relevance" in data for data in queries.values())

    def join_nodes(name: str) -> Tensor:
        return torch.cat([graph.nodes[ntype].data[name] for ntype in NODE_TYPES])

    def join_queries(name: str) -> Tensor:
        return torch.cat([queries[etype][name][rows] for etype, rows in marked.items()])

    return {
        "node_counts": node_counts,
        "edge_counts": edge_counts,
        "label": join_nodes("label"),
        "node_feature": join_nodes("temporal"),
        "degrees": join_nodes("degrees"),
        "node_snapshot": join_nodes("snapshot"),
        "furniture_index": graph.nodes["furniture"].data["index"],
        "edge_src": torch.cat([src for src, _ in ends]),
        "edge_dst": torch.cat([dst for _, dst in ends]),
        "edge_feature": torch.cat([graph.edges[etype].data["feature"] for etype in EDGE_TYPES]),
        "query_edge": torch.cat([rows + first_edge[etype] for etype, rows in marked.items()]),
        "query_snapshot": join_queries("query"),
        "query_target": join_queries("target"),
        "query_relevance": join_queries("relevance") if has_relevance else None,
        "evidence": graph.nodes["furniture"].data.get("evidence"),
    }

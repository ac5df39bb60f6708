"""What nodes and edges carry in a graph of DGL or PyTorch Geometric, by node and edge type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

EdgeType = tuple[str, str, str]
Data = Mapping[Any, Mapping[str, Tensor]]  # columns by node or edge type
Ends = Mapping[EdgeType, tuple[Tensor, Tensor]]  # ids count from 0 in each node type

# What nodes of every type, furniture and query edges carry in a graph, and the fields of `Batch`;
# of query edges also what others carry.
NODE_DATA = {
    "label": "label",
    "temporal": "node_feature",
    "degrees": "degrees",
    "snapshot": "node_snapshot",
}
FURNITURE_DATA = {"index": "furniture_index", "evidence": "evidence"}
QUERY_DATA = {
    "query": ("query_snapshot", -1),
    "target": ("query_target", torch.nan),
    "relevance": ("query_relevance", 0),
}


def list_node_data(batch: Any) -> dict[str, dict[str, Tensor]]:
    """Return the columns of each node type, by the names that they have in a graph."""
    columns = {name: getattr(batch, field) for name, field in NODE_DATA.items()}
    columns["degree"] = batch.degree
    split = {name: batch.split_nodes(values) for name, values in columns.items()}
    node_data = {
        ntype: {name: parts[ntype] for name, parts in split.items()} for ntype in NODE_TYPES
    }
    for name, field in FURNITURE_DATA.items():
        if (values := getattr(batch, field)) is not None:
            node_data["furniture"][name] = values
    return node_data


def list_edge_data(batch: Any) -> dict[EdgeType, dict[str, Tensor]]:
    """Return the columns of each edge type, by the names that they have in a graph."""
    features = batch.split_edges(batch.edge_feature)
    edge_data = {etype: {"feature": part} for etype, part in features.items()}
    for name, (field, other) in QUERY_DATA.items():
        column = getattr(batch, field)
        if column is None:
            continue
        whole = column.new_full((batch.num_edges,), other)
        parts = batch.split_edges(whole.index_copy(0, batch.query_edge, column))
        for etype in QUERY_EDGE_TYPES:
            edge_data[etype][name] = parts[etype]
    return edge_data


def list_ends(batch: Any) -> dict[EdgeType, tuple[Tensor, Tensor]]:
    """Return source and destination of the edges of each type, ids from 0 in each node type."""
    first = batch.first_node
    src, dst = batch.split_edges(batch.edge_src), batch.split_edges(batch.edge_dst)
    return {
        etype: (src[etype] - first[etype[0]], dst[etype] - first[etype[2]]) for etype in EDGE_TYPES
    }

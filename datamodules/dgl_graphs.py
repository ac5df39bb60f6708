"""The two graphs of DGL that a batch gives: all types in one, and by node and edge type."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import torch

from datamodules.graph_columns import list_edge_data, list_ends, list_node_data
from datamodules.message_passing import ETYPE, NTYPE, make_graph
from sgm.schema import NODE_TYPES

if TYPE_CHECKING:
    import dgl


def make_homogeneous(batch: Any) -> Any:
    """Make `Batch.homogeneous`, which encoders read, of DGL or its stand-in."""
    graph = make_graph(batch.edge_src, batch.edge_dst, batch.num_nodes)
    graph.ndata[NTYPE], graph.edata[ETYPE] = batch.node_type, batch.edge_type
    graph.ndata["degree"] = batch.degree
    return graph


def make_heterogeneous(batch: Any) -> dgl.DGLGraph:
    """Make `Batch.graph`, which knows its snapshots, as a graph of `dgl.batch` does.

    Raises:
        ModuleNotFoundError: if DGL is not installed.
    """
    try:
        import dgl
    except ModuleNotFoundError as error:
        if error.name != "dgl":
            raise
        raise ModuleNotFoundError(
            "batch.graph must have DGL, got none. Its wheels end with Python 3.11: pip install "
            "'dgl>=1.1.3,<2' there. batch.to_pyg() gives the same graph without it.",
            name="dgl",
        ) from error
    node_data, ends = list_node_data(batch), list_ends(batch)
    graph = dgl.heterograph(
        ends, num_nodes_dict=dict(zip(NODE_TYPES, batch.node_counts, strict=True))
    )
    for ntype, columns in node_data.items():
        graph.nodes[ntype].data.update(columns)
    for etype, columns in list_edge_data(batch).items():
        graph.edges[etype].data.update(columns)
    snapshot = {ntype: columns["snapshot"] for ntype, columns in node_data.items()}
    count = partial(torch.bincount, minlength=batch.num_snapshots)
    graph.set_batch_num_nodes({ntype: count(found) for ntype, found in snapshot.items()})
    graph.set_batch_num_edges(
        {etype: count(snapshot[etype[2]][dst.long()]) for etype, (_, dst) in ends.items()}
    )
    return graph

"""Encoders that read a graph by node and edge type. Not in the paper."""

from __future__ import annotations

import torch
from torch import Tensor

from datamodules.batch import Batch
from nep.paper.encoders.encoder import Encoder
from sgm.schema import NODE_TYPES


class HeteroEncoder(Encoder):
    """An encoder that gets the batch as a heterogeneous DGL graph, for `dgl.nn.HeteroGraphConv`.

    Its `forward` gets `Batch.graph`, embedded nodes of every node type, (N, D) each, and embedded
    edges of every edge type, (E, D) each; none unless `uses_edges`. It returns (N, D) for each
    node type; the nodes of a type that is left out stay as they are.
    """

    def _run(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        nodes = batch.split_nodes(node)
        edges = {} if edge is None else batch.split_edges(edge)
        with batch.graph.local_scope():
            encoded = self(batch.graph, nodes, edges)
        return torch.cat([encoded.get(ntype, nodes[ntype]) for ntype in NODE_TYPES])

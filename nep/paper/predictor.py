"""The paper's Node Edge Predictor: one logit for each query edge of a batch of snapshots."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.paper.embedding import EdgeEmbedding, NodeEmbedding
from nep.paper.encoders.encoder import Encoder
from nep.paper.query_attention import AttentionConfig, QueryAttention
from nep.training.logits import Logits


class NodeEdgePredictor(nn.Module):
    """Embeds nodes and edges, passes messages, fuses query edges, lets them attend to each other.

    A query edge is the mean of its two nodes' encodings beside its own embedding: 2 D wide.

    Args:
        encoder: the message passing; its `units` are D.
        attention: sizes of the transformer over the query edges of a snapshot; None for none.
        reads: groups of features beyond the paper's that it reads.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        attention: AttentionConfig | None = AttentionConfig(),
        reads: Sequence[str] = (),
    ) -> None:
        super().__init__()
        units = encoder.units
        self.node_embedding = NodeEmbedding(units, reads)
        self.edge_embedding = EdgeEmbedding(units, reads)
        self.encoder = encoder
        self.query_attention = None if attention is None else QueryAttention(2 * units, attention)
        last = nn.Linear(units, 1)
        # The loss weighs true and false edges alike, so that 0.5 is the best constant answer.
        nn.init.zeros_(last.bias)
        self.head = nn.Sequential(
            nn.Linear(2 * units, units), nn.ReLU(), nn.Linear(units, units), nn.ReLU(), last
        )

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        node = self.node_embedding(batch)
        if self.encoder.uses_edges:
            edge = self.edge_embedding(batch)
            query_edge = edge.index_select(0, batch.query_edge)
        else:
            edge = None
            query_edge = self.edge_embedding(batch, batch.query_edge)
        node = self.encoder.encode(batch, node, edge)
        src = node.index_select(0, batch.edge_src.index_select(0, batch.query_edge))
        dst = node.index_select(0, batch.edge_dst.index_select(0, batch.query_edge))
        query = torch.cat([(src + dst) / 2, query_edge], dim=1)  # (Q, 2 D)
        if self.query_attention is not None:
            query = self.query_attention(query, batch.query_snapshot, batch.num_snapshots)
        logits: Tensor = self.head(query).squeeze(1)
        return logits

    def answer(self, batch: Batch) -> Logits:
        """Score the query edges; of elsewhere it says nothing."""
        return Logits(self(batch), None)

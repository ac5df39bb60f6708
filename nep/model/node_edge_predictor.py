"""The Node Edge Predictor: one logit for each query edge of a batch of snapshots."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import Encoder
from nep.layers.ensemble_linear import make_linear
from nep.layers.segment import segment_softmax
from nep.model.embedding import EdgeEmbedding, EvidenceEmbedding, NodeEmbedding
from nep.model.query_attention import QueryAttention
from nep.model.settings import NetworkConfig


class NodeEdgePredictor(nn.Module):
    """Embeds nodes and edges, passes messages, fuses query edges, lets them attend to each other.

    A query edge is the mean of its two nodes' encodings beside its own embedding: 2 D wide. With
    an encoder of several members each of them gives its own answer, all are trained on the same
    batches, and the probability of a query edge is the mean of theirs.

    Args:
        encoder: the message passing; its `units` are D, its `members` M.
        network: its other parts.
        reads: groups of features beyond the paper's that it reads. With "evidence" furniture nodes
            carry evidence, whose embedding is added to theirs.

    Raises:
        ValueError: if the query edges of an ensemble are to attend to each other.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        network: NetworkConfig = NetworkConfig(),
        reads: Sequence[str] = (),
    ) -> None:
        super().__init__()
        units, members = encoder.units, encoder.members
        if network.transformer and members > 1:
            raise ValueError(
                f"transformer must be false for an encoder of several members, got {members} "
                "members. Set model.transformer to false, or members to 1."
            )
        self.node_embedding = NodeEmbedding(units, reads, members)
        self.edge_embedding = EdgeEmbedding(units, reads, members)
        self.evidence_embedding = (
            EvidenceEmbedding(units, reads, network.clock_dropout, members)
            if "evidence" in reads
            else None
        )
        self.encoder = encoder
        self.query_attention = (
            QueryAttention(
                2 * units,
                network.transformer_layers,
                network.transformer_heads,
                network.feed_forward_units,
                network.dropout,
            )
            if network.transformer
            else None
        )
        last = make_linear(units, 1, members)
        # The loss weighs true and false edges alike, so that 0.5 is the best constant answer.
        assert last.bias is not None
        nn.init.zeros_(last.bias)
        self.head = nn.Sequential(
            make_linear(2 * units, units, members),
            nn.ReLU(),
            make_linear(units, units, members),
            nn.ReLU(),
            last,
        )

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.join_answers(batch, self.score_members(batch))

    def join_answers(self, batch: Batch, logits: Tensor) -> Tensor:
        """Make one answer of those of all members: (Q, M) -> (Q,).

        Those of several are logarithms of the mean of their probabilities: each snapshot's sum to
        one.
        """
        if logits.shape[1] == 1:
            return logits.squeeze(1)
        share = segment_softmax(logits, batch.query_snapshot, batch.num_snapshots).mean(dim=1)
        return share.clamp(min=torch.finfo(share.dtype).tiny).log()

    def score_members(self, batch: Batch) -> Tensor:
        """Score the query edges by each member: logits (Q, M) in query order."""
        node = self.node_embedding(batch)
        if self.evidence_embedding is not None:
            evidence, places = self.evidence_embedding(batch), batch.furniture
            parts = [node[: places.start], node[places] + evidence, node[places.stop :]]
            node = torch.cat(parts)
        if self.encoder.uses_edges:
            edge = self.edge_embedding(batch)
            query_edge = edge.index_select(0, batch.query_edge)
        else:
            edge = None
            query_edge = self.edge_embedding(batch, batch.query_edge)
        node = self.encoder(batch, node, edge)
        src_row = batch.edge_src.index_select(0, batch.query_edge)
        dst_row = batch.edge_dst.index_select(0, batch.query_edge)
        src, dst = node.index_select(0, src_row), node.index_select(0, dst_row)
        query = torch.cat([(src + dst) / 2, query_edge], dim=-1)  # (Q, 2 D) or (Q, M, 2 D)
        if self.query_attention is not None:
            query = self.query_attention(query, batch.query_snapshot, batch.num_snapshots)
        logit = self.head(query).flatten(1)
        if self.evidence_embedding is not None:
            by_place = self.evidence_embedding.compute_shortcut(batch)  # (NF, M)
            place = dst_row - batch.furniture.start  # query edges lead to furniture
            logit = logit + by_place.index_select(0, place)
        return logit

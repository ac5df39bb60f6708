"""The Node Edge Predictor: one logit for each query edge of a batch of snapshots, and elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from datamodules.features import count_columns
from nep.encoders.encoder import Encoder
from nep.layers.ensemble_linear import make_linear
from nep.layers.segment import segment_softmax
from nep.model.elsewhere import ElsewhereHead
from nep.model.embedding import EdgeEmbedding, EvidenceEmbedding, NodeEmbedding
from nep.model.query_attention import QueryAttention
from nep.model.settings import NetworkConfig


@dataclass(frozen=True, slots=True)
class Logits:
    """What a network says of the Q query edges of B snapshots; probabilities are softmax shares.

    Attributes:
        edges: of the query edges, (Q,), or (Q, M) of each member of an ensemble.
        elsewhere: that what is asked for is at no place, (B,) or (B, M); None where the network
            does not say so.
    """

    edges: Tensor
    elsewhere: Tensor | None

    def join(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Return all answers of a batch, and the snapshot of each: elsewhere follows the edges."""
        if self.elsewhere is None:
            return self.edges, batch.query_snapshot
        snapshot = torch.arange(batch.num_snapshots, device=self.edges.device)
        answers = torch.cat([self.edges, self.elsewhere])
        return answers, torch.cat([batch.query_snapshot, snapshot])

    def split(self) -> list[Logits]:
        """Return those of each member."""
        edges = self.edges.unbind(dim=1)
        if self.elsewhere is None:
            return [Logits(logits, None) for logits in edges]
        both = zip(edges, self.elsewhere.unbind(dim=1), strict=True)
        return [Logits(logits, elsewhere) for logits, elsewhere in both]


class NodeEdgePredictor(nn.Module):
    """Embeds nodes and edges, passes messages, fuses query edges, lets them attend to each other.

    A query edge is the mean of its two nodes' encodings beside its own embedding: 2 D wide. With
    an encoder of several members each of them gives its own answer, all are trained on the same
    batches, and the probability of a query edge is the mean of theirs. With evidence it may also
    say how likely what is asked for is at no place.

    Args:
        encoder: the message passing; its `units` are D, its `members` M.
        network: its other parts.
        reads: groups of features beyond the paper's that it reads. With "evidence" furniture nodes
            carry evidence, whose embedding is added to theirs.

    Raises:
        ValueError: if the query edges of an ensemble are to attend to each other, or elsewhere is
            to be answered without evidence.

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
        if network.elsewhere and "evidence" not in reads:
            raise ValueError(
                "elsewhere must be false for a network without evidence, got true. Set "
                "model.elsewhere to false, or data.features.evidence to true."
            )
        self.node_embedding = NodeEmbedding(units, reads, members)
        self.edge_embedding = EdgeEmbedding(units, reads, members)
        self.evidence_embedding = (
            EvidenceEmbedding(units, reads, network.clock_dropout, members)
            if "evidence" in reads
            else None
        )
        self.elsewhere = (
            ElsewhereHead(units, members, count_columns("question", reads))
            if network.elsewhere
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
        return self.answer(batch).edges

    def answer(self, batch: Batch) -> Logits:
        """Score the query edges and elsewhere, all members together."""
        return self.join_members(batch, self.score_members(batch))

    def join_members(self, batch: Batch, logits: Logits) -> Logits:
        """Make one answer of those of all members.

        Those of several are logarithms of the mean of their probabilities: each snapshot's sum to
        one.
        """
        answers, snapshot = logits.join(batch)
        if answers.shape[1] > 1:
            share = segment_softmax(answers, snapshot, batch.num_snapshots).mean(dim=1)
            answers = share.clamp(min=torch.finfo(share.dtype).tiny).log()
        else:
            answers = answers.squeeze(1)
        if logits.elsewhere is None:
            return Logits(answers, None)
        num_edges = len(logits.edges)
        return Logits(answers[:num_edges], answers[num_edges:])

    def score_members(self, batch: Batch) -> Logits:
        """Score the query edges and elsewhere by each member."""
        node, asked = self.node_embedding(batch), None
        if self.evidence_embedding is not None:
            evidence, asked = self.evidence_embedding(batch)
            places = batch.furniture
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
        if self.elsewhere is None:
            return Logits(logit, None)
        assert asked is not None
        return Logits(logit, self.elsewhere(batch, node[batch.furniture], asked))

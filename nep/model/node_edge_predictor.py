"""The Node Edge Predictor: one logit for each query edge of a batch of snapshots."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import SGMBatch
from nep.encoders.encoder import Encoder
from nep.layers.ensemble_linear import make_linear
from nep.layers.flat_graph import FlatGraph
from nep.layers.segment import segment_softmax
from nep.model.embedding import EdgeEmbedding, NodeEmbedding
from nep.model.evidence_embedding import EvidenceEmbedding
from nep.model.query_attention import QueryAttention


class NodeEdgePredictor(nn.Module):
    """Embeds nodes and edges, passes messages, fuses query edges, lets them attend to each other.

    A query edge is the mean of its two nodes' encodings beside its own embedding: 2 D wide. With
    an encoder of several members each of them gives its own answer, all are trained on the same
    batches, and the probability of a query edge is the mean of theirs.

    Args:
        encoder: the message passing; its `units` are D, its `members` M.
        transformer: whether the query edges of a snapshot attend to each other.
        transformer_layers: encoder layers of that attention.
        transformer_heads: heads of each layer.
        feed_forward_units: hidden width of each layer's feed-forward network.
        dropout: probability in those layers; PyTorch's default, which the paper keeps.
        belief: whether edges carry the belief features (`FeatureConfig.belief`).
        clock: whether edges carry the clock features (`FeatureConfig.clock`).
        evidence: whether furniture nodes carry evidence (`FeatureConfig.evidence`), whose embedding
            is added to theirs.
        clock_dropout: see `EvidenceEmbedding`.

    Raises:
        ValueError: if the query edges of an ensemble are to attend to each other.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        transformer: bool = True,
        transformer_layers: int = 2,
        transformer_heads: int = 2,
        feed_forward_units: int = 64,
        dropout: float = 0.1,
        belief: bool = False,
        clock: bool = False,
        evidence: bool = False,
        clock_dropout: float = 0.5,
    ) -> None:
        super().__init__()
        units, members = encoder.units, encoder.members
        if transformer and members > 1:
            raise ValueError(
                f"transformer must be false for an encoder of several members, got {members} "
                "members. Set model.transformer to false, or members to 1."
            )
        self.node_embedding = NodeEmbedding(units, members)
        self.edge_embedding = EdgeEmbedding(units, belief, clock, members)
        self.evidence_embedding = (
            EvidenceEmbedding(units, clock_dropout, members) if evidence else None
        )
        self.encoder = encoder
        self.query_attention = (
            QueryAttention(
                2 * units, transformer_layers, transformer_heads, feed_forward_units, dropout
            )
            if transformer
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

    def forward(self, batch: SGMBatch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.score(FlatGraph.from_batch(batch))

    def score(self, graph: FlatGraph) -> Tensor:
        """Score the query edges of an already flattened batch: logits (Q,) in query order."""
        return self.join_answers(graph, self.score_members(graph))

    def join_answers(self, graph: FlatGraph, logits: Tensor) -> Tensor:
        """Make one answer of those of all members: (Q, M) -> (Q,).

        Those of several are logarithms of the mean of their probabilities: each snapshot's sum to
        one.
        """
        if logits.shape[1] == 1:
            return logits.squeeze(1)
        share = segment_softmax(logits, graph.query_snapshot, graph.num_snapshots).mean(dim=1)
        return share.clamp(min=torch.finfo(share.dtype).tiny).log()

    def score_members(self, graph: FlatGraph) -> Tensor:
        """Score the query edges by each member: logits (Q, M) in query order."""
        node = self.node_embedding(graph)
        if self.evidence_embedding is not None:
            evidence, places = self.evidence_embedding(graph), graph.furniture
            parts = [node[: places.start], node[places] + evidence, node[places.stop :]]
            node = torch.cat(parts)
        if self.encoder.uses_edges:
            edge = self.edge_embedding(graph)
            query_edge = edge.index_select(0, graph.query_edge)
        else:
            edge = None
            query_edge = self.edge_embedding(graph, graph.query_edge)
        node = self.encoder(graph, node, edge)
        src_row = graph.edge_src.index_select(0, graph.query_edge)
        dst_row = graph.edge_dst.index_select(0, graph.query_edge)
        src, dst = node.index_select(0, src_row), node.index_select(0, dst_row)
        query = torch.cat([(src + dst) / 2, query_edge], dim=-1)  # (Q, 2 D) or (Q, M, 2 D)
        if self.query_attention is not None:
            query = self.query_attention(query, graph.query_snapshot, graph.num_snapshots)
        logit = self.head(query).flatten(1)
        if self.evidence_embedding is not None:
            by_place = self.evidence_embedding.compute_shortcut(graph)  # (NF, M)
            place = dst_row - graph.furniture.start  # query edges lead to furniture
            logit = logit + by_place.index_select(0, place)
        return logit

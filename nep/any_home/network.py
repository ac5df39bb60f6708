"""The network for any home: a logit for each place, and for elsewhere, from evidence alone."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from datamodules.feature_config import list_columns
from nep.any_home.elsewhere import ElsewhereHead
from nep.any_home.ensemble_linear import EnsembleLinear, SharedInput
from nep.any_home.evidence_embedding import EvidenceEmbedding
from nep.any_home.sets import Sets
from nep.training.logits import Logits
from nep.training.segment import segment_softmax
from sgm.evidence.columns import QUESTION_COLUMNS
from sgm.schema import RELATIONS

(_PRIOR,) = (rows.start for feature, rows in list_columns("edge", ()) if feature.group == "prior")


class AnyHomeNetwork(nn.Module):
    """Embeds the evidence of places, compares them as a set, and answers each and elsewhere.

    A query edge is the mean of its object's and its place's vectors beside the embedding of its
    prior and relation. Several members, networks of their own weights, are trained on the same
    batches, and the probability of an answer is the mean of theirs.

    Args:
        units: D, width of all layers.
        num_rounds: see `Sets`.
        members: M, networks in an ensemble.
        clock_dropout: see `EvidenceEmbedding`.

    Source: not in the paper.
    """

    def __init__(self, units: int, num_rounds: int, members: int, clock_dropout: float) -> None:
        super().__init__()
        self.members = members
        self.evidence_embedding = EvidenceEmbedding(units, members, clock_dropout)
        self.node_embedding = SharedInput(2, units, members)  # of (is a place, is an object)
        self.edge_embedding = SharedInput(1 + len(RELATIONS), units, members)
        self.sets = Sets(units, num_rounds, members)
        self.elsewhere = ElsewhereHead(units, members, len(QUESTION_COLUMNS))
        last = EnsembleLinear(units, 1, members)
        assert last.bias is not None
        nn.init.zeros_(last.bias)
        self.head = nn.Sequential(
            EnsembleLinear(2 * units, units, members),
            nn.ReLU(),
            EnsembleLinear(units, units, members),
            nn.ReLU(),
            last,
        )

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.answer(batch).edges

    def answer(self, batch: Batch) -> Logits:
        """Score the query edges and elsewhere, all members together."""
        logits = self.join_members(*self.score_members(batch), batch.num_snapshots)
        num_edges = len(batch.query_edge)
        return Logits(logits[:num_edges], logits[num_edges:])

    def score_members(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Score the query edges and then elsewhere, by each member.

        Returns:
            Logits (Q + B, M), and the snapshot of each, (Q + B,).

        Raises:
            ValueError: if the batch holds no evidence.
        """
        evidence, question = batch.evidence, batch.question
        if evidence is None or question is None:
            raise ValueError(
                "batch must hold evidence for the network for any home, got none. Build it with "
                "features.evidence."
            )
        snapshot = batch.node_snapshot[batch.furniture]
        embedded, asked = self.evidence_embedding(evidence, question, snapshot)
        of_place, of_object = self.node_embedding(torch.eye(2).to(evidence))  # (M, D) each
        places = self.sets(embedded + of_place, snapshot, batch.num_snapshots)  # (NF, M, D)
        place = batch.edge_dst.index_select(0, batch.query_edge) - batch.furniture.start  # (Q,)
        prior = batch.edge_feature[:, _PRIOR].index_select(0, batch.query_edge)
        relation = nn.functional.one_hot(batch.query_relation, len(RELATIONS)).to(evidence)
        edge = self.edge_embedding(torch.cat([prior.unsqueeze(1), relation], dim=1))
        query = torch.cat([(of_object + places.index_select(0, place)) / 2, edge], dim=2)
        by_place = self.evidence_embedding.compute_shortcut(evidence)  # (NF, M)
        edges = self.head(query).flatten(1) + by_place.index_select(0, place)
        elsewhere = self.elsewhere(places, snapshot, asked, question)
        each = torch.arange(batch.num_snapshots, device=snapshot.device)
        return torch.cat([edges, elsewhere]), torch.cat([batch.query_snapshot, each])

    def join_members(self, logits: Tensor, snapshot: Tensor, num_snapshots: int) -> Tensor:
        """Make one answer of those of all members: (A, M), (A,) -> (A,).

        Those of several are logarithms of the mean of their probabilities: each snapshot's sum to
        one.
        """
        if self.members == 1:
            return logits.squeeze(1)
        share = segment_softmax(logits, snapshot, num_snapshots).mean(dim=1)
        return share.clamp(min=torch.finfo(share.dtype).tiny).log()

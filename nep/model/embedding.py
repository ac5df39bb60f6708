"""Embedding of the features of nodes and edges, and of what the memory says about places."""

from __future__ import annotations

from collections.abc import Collection

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import Batch
from datamodules.features import NODE_FEATURE_DIM, TEXT_DIM, count_columns
from nep.layers.ensemble_linear import gelu, make_linear, split_members
from nep.layers.equal_rows import Linear, multiply
from sgm.evidence.columns import CLOCK_GROUPS, PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.schema import EDGE_RELATIONS, EDGE_TYPES, NODE_TYPES

_LEAST_VARIANCE = 4e-4  # of a column, so that one that hardly varies is not blown up
FILTER_BELIEFS = tuple(name for name in PLACE_COLUMNS if name.startswith("filters.log_belief_"))
_FIRST_BELIEF = "filters.log_belief_asked"  # what an untrained network answers, all but noise
MOST_DEVIATIONS = 8.0  # from the mean, of a column


class FeatureEmbedding(nn.Module):
    """Two ReLU layers.

    Args:
        num_features: columns that the first one reads.
        units: width of both, for each member of an ensemble.
        members: M, see `Encoder`.
    """

    def __init__(self, num_features: int, units: int, members: int) -> None:
        super().__init__()
        self.members = members
        self.first = Linear(num_features, members * units)
        self.second = make_linear(units, units, members)

    def finish(self, hidden: Tensor) -> Tensor:
        """Finish what the first layer has summed up, in place: (n, M units) -> (n, M, units)."""
        hidden = split_members(F.relu(hidden, inplace=True), self.members)
        return F.relu(self.second(hidden), inplace=True)


class NodeEmbedding(FeatureEmbedding):
    """Two ReLU layers over [text (96), features (4), node type one-hot (5), more features].

    The last are those of groups beyond the paper's. Features that are switched off count as zeros.
    Where nodes are many, the text and type parts of the first layer are computed once per pair of
    type and label and gathered: equal to concatenating the 105 features of every node, without
    making them.

    Args:
        units, members: as for `FeatureEmbedding`.
        reads: groups of features beyond the paper's that are on.

    Source: paper appendices B and C.
    """

    def __init__(self, units: int, reads: Collection[str] = (), members: int = 1) -> None:
        num_features = TEXT_DIM + len(NODE_TYPES) + count_columns("node", reads)
        super().__init__(num_features, units, members)

    def forward(self, batch: Batch) -> Tensor:
        """Embed all nodes: (N, units), or (N, M, units) of several members."""
        sizes = [TEXT_DIM, NODE_FEATURE_DIM, len(NODE_TYPES)]
        sizes.append(self.first.weight.shape[1] - sum(sizes))
        text_weight, feature_weight, type_weight, more = self.first.weight.split(sizes, dim=1)
        of_type = type_weight.t()  # (5, M units)
        if not batch.text.shape[1] and not batch.node_feature.shape[1]:  # nodes of a type are alike
            return batch.repeat_per_node_type(self.finish(of_type + self.first.bias))
        text_weight = text_weight[:, : batch.text.shape[1]]
        if batch.num_nodes < len(of_type) * len(batch.text):  # of a single home
            text = batch.text.index_select(0, batch.label)  # often fewer than there are labels
            known = multiply(text, text_weight.t(), self.first.bias)  # (N, M units)
            known = known + batch.repeat_per_node_type(of_type)
        else:
            text = multiply(batch.text, text_weight.t(), self.first.bias)  # (L, M units)
            table = (of_type.unsqueeze(1) + text).flatten(0, 1)  # (5 L, M units)
            blocks = enumerate(batch.label.split(batch.node_counts))
            table_row = torch.cat([label + ntype * len(text) for ntype, label in blocks])  # (N,)
            known = table.index_select(0, table_row)
        if more.shape[1]:
            feature_weight = torch.cat([feature_weight, more], dim=1)
        feature_weight = feature_weight[:, : batch.node_feature.shape[1]]
        return self.finish(multiply(batch.node_feature, feature_weight.t(), known))


class EdgeEmbedding(FeatureEmbedding):
    """Two layers over [edge features (9 or more), relation one-hot (4)], ReLU after each.

    Args:
        units, members: as for `FeatureEmbedding`.
        reads: groups of features beyond the paper's that are on.

    Source: paper appendices B and C.
    """

    relation: Tensor

    def __init__(self, units: int, reads: Collection[str] = (), members: int = 1) -> None:
        super().__init__(count_columns("edge", reads) + len(EDGE_RELATIONS), units, members)
        one_hot = torch.eye(len(EDGE_RELATIONS))
        relation = torch.stack([one_hot[EDGE_RELATIONS.index(name)] for _, name, _ in EDGE_TYPES])
        self.register_buffer("relation", relation, persistent=False)  # (10, 4)

    def forward(self, batch: Batch, edges: Tensor | None = None) -> Tensor:
        """Embed all edges, (E, units) or (E, M, units), or only `edges`, int64 (n,)."""
        features = torch.cat([batch.edge_feature, batch.repeat_per_edge_type(self.relation)], dim=1)
        if edges is not None:
            features = features.index_select(0, edges)
        return self.finish(self.first(features))


class EvidenceEmbedding(nn.Module):
    """Two layers over the evidence of a furniture node and of its question, GELU after each.

    Columns are standardised by what training showed, and clipped. `compute_shortcut` leads the
    logarithms of the filters' beliefs past the network, so that it learns what to add to them.

    Args:
        units: width of both layers, for each member of an ensemble.
        reads: groups of features beyond the paper's that are on.
        clock_dropout: share of the questions that hide the clock while training, so that one
            network serves homes with and without one.
        members: M, see `Encoder`.
    """

    belief_columns: Tensor
    place_has_clock: Tensor
    question_has_clock: Tensor

    def __init__(
        self,
        units: int,
        reads: Collection[str] = ("evidence",),
        clock_dropout: float = 0.5,
        members: int = 1,
    ) -> None:
        super().__init__()
        num_place, num_question = count_columns("place", reads), count_columns("question", reads)
        self.clock_dropout = clock_dropout
        self.members = members
        # A plain average over all batches: no momentum to choose.
        self.place_scale = nn.BatchNorm1d(num_place, _LEAST_VARIANCE, None, affine=False)
        self.question_scale = nn.BatchNorm1d(num_question, _LEAST_VARIANCE, None, affine=False)
        self.place = nn.Linear(num_place, members * units)
        self.question = nn.Linear(num_question, members * units, bias=False)
        self.second = make_linear(units, units, members)
        self.shortcut = nn.Linear(len(FILTER_BELIEFS), members, bias=False)
        with torch.no_grad():
            self.shortcut.weight.zero_()[:, FILTER_BELIEFS.index(_FIRST_BELIEF)] = 1
        beliefs = torch.tensor([PLACE_COLUMNS.index(name) for name in FILTER_BELIEFS])
        self.register_buffer("belief_columns", beliefs, persistent=False)
        for name, columns, count in (
            ("place", PLACE_COLUMNS, num_place),
            ("question", QUESTION_COLUMNS, num_question),
        ):
            is_clock = [column.partition(".")[0] in CLOCK_GROUPS for column in columns]
            is_clock += [False] * (count - len(columns))  # further features
            self.register_buffer(f"{name}_has_clock", torch.tensor(is_clock), persistent=False)

    def forward(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Embed the furniture nodes: (NF, units), or (NF, M, units) of several members.

        And return the standardised evidence of the questions, (B, C).

        Raises:
            ValueError: if the batch holds no evidence.
        """
        if batch.evidence is None or batch.question is None:
            raise ValueError(
                "batch must hold evidence for a model with evidence, got none. Build it with "
                "features.evidence."
            )
        place, question = batch.evidence, batch.question
        snapshot = batch.node_snapshot[batch.furniture]
        if self.training and self.clock_dropout:
            hides = torch.rand(len(question), 1, device=question.device) < self.clock_dropout
            question = question.masked_fill(hides & self.question_has_clock, 0)
            place = place.masked_fill(hides[snapshot] & self.place_has_clock, 0)
        place = self.place_scale(place).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        question = self.question_scale(question).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        hidden = self.place(place) + self.question(question).index_select(0, snapshot)
        return gelu(self.second(gelu(split_members(hidden, self.members)))), question

    def compute_shortcut(self, batch: Batch) -> Tensor:
        """Return what the filters add to the logits of furniture nodes, (NF, M)."""
        assert batch.evidence is not None
        shortcut: Tensor = self.shortcut(batch.evidence.index_select(1, self.belief_columns))
        return shortcut

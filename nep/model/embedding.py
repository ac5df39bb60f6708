"""Embedding of raw node and edge features."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import (
    EDGE_FEATURE_DIM,
    EDGE_TYPES,
    NODE_TEMPORAL_DIM,
    NODE_TYPES,
    RELATIONS,
    TEXT_DIM,
)
from datamodules.features import BELIEF_DIM, CLOCK_DIM
from nep.layers.ensemble_linear import make_linear, split_members
from nep.layers.flat_graph import FlatGraph


class NodeEmbedding(nn.Module):
    """Two ReLU layers over [text vector (96), temporal features (4), node type one-hot (5)].

    Features that are switched off count as zeros. Where nodes are many, the text and type parts of
    the first layer are computed once per pair of type and label and gathered: equal to
    concatenating the 105 features of every node, without making them.

    Args:
        units: width of both layers, for each member of an ensemble.
        members: M, see `Encoder`.

    Source: paper appendices B and C.
    """

    def __init__(self, units: int, members: int = 1) -> None:
        super().__init__()
        num_features = TEXT_DIM + NODE_TEMPORAL_DIM + len(NODE_TYPES)
        self.members = members
        self.first = nn.Linear(num_features, members * units)
        self.second = make_linear(units, units, members)

    def forward(self, graph: FlatGraph) -> Tensor:
        """Embed all nodes: (N, units), or (N, M, units) of several members."""
        weights = self.first.weight.split([TEXT_DIM, NODE_TEMPORAL_DIM, len(NODE_TYPES)], dim=1)
        text_weight, temporal_weight, type_weight = weights
        of_type = type_weight.t()  # (5, M units)
        if not graph.text.shape[1] and not graph.temporal.shape[1]:  # nodes of a type are alike
            return graph.repeat_per_node_type(self._embed(of_type + self.first.bias))
        text_weight = text_weight[:, : graph.text.shape[1]]
        if graph.num_nodes < len(of_type) * len(graph.text):  # of a single home
            text = graph.text.index_select(0, graph.label)  # often fewer than there are labels
            known = F.linear(text, text_weight, self.first.bias)  # (N, M units)
            known = known + graph.repeat_per_node_type(of_type)
        else:
            text = F.linear(graph.text, text_weight, self.first.bias)  # (L, M units)
            table = (of_type.unsqueeze(1) + text).flatten(0, 1)  # (5 L, M units)
            blocks = enumerate(graph.label.split(graph.node_counts))
            row = torch.cat([label + ntype * len(text) for ntype, label in blocks])  # (N,)
            known = table.index_select(0, row)
        temporal_weight = temporal_weight[:, : graph.temporal.shape[1]]
        return self._embed(torch.addmm(known, graph.temporal, temporal_weight.t()))

    def _embed(self, hidden: Tensor) -> Tensor:
        """Finish what the first layer has summed up, in place: (n, M units) -> (n, M, units)."""
        hidden = split_members(F.relu(hidden, inplace=True), self.members)
        return F.relu(self.second(hidden), inplace=True)


class EdgeEmbedding(nn.Module):
    """Two layers over [edge features (9 to 22), relation one-hot (4)], ReLU after each.

    Args:
        units: width of both layers, for each member of an ensemble.
        belief: whether edges carry the 5 belief features.
        clock: whether edges carry the 8 clock features.
        members: M, see `Encoder`.

    Source: paper appendices B and C.
    """

    relation: Tensor

    def __init__(
        self, units: int, belief: bool = False, clock: bool = False, members: int = 1
    ) -> None:
        super().__init__()
        num_features = EDGE_FEATURE_DIM + BELIEF_DIM * belief + CLOCK_DIM * clock
        self.members = members
        self.first = nn.Linear(num_features + len(RELATIONS), members * units)
        self.second = make_linear(units, units, members)
        one_hot = torch.eye(len(RELATIONS))
        relation = torch.stack([one_hot[RELATIONS.index(name)] for _, name, _ in EDGE_TYPES])
        self.register_buffer("relation", relation, persistent=False)  # (10, 4)

    def forward(self, graph: FlatGraph, edges: Tensor | None = None) -> Tensor:
        """Embed all edges, (E, units) or (E, M, units), or only `edges`, int64 (n,)."""
        features = torch.cat(
            [graph.edge_feature, graph.repeat_per_edge_type(self.relation)], dim=1
        )  # (E, 13 to 26)
        if edges is not None:
            features = features.index_select(0, edges)
        hidden = split_members(F.relu(self.first(features), inplace=True), self.members)
        return F.relu(self.second(hidden), inplace=True)

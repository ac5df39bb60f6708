"""Embedding of raw node and edge features."""

from __future__ import annotations

from collections.abc import Collection

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import EDGE_TYPES, NODE_TYPES, RELATIONS, Batch
from datamodules.features import NODE_FEATURE_DIM, TEXT_DIM, count_columns
from nep.layers.ensemble_linear import make_linear, split_members
from nep.layers.equal_rows import Linear, multiply


class NodeEmbedding(nn.Module):
    """Two ReLU layers over [text (96), features (4), node type one-hot (5), more features].

    The last are those of groups beyond the paper's. Features that are switched off count as zeros.
    Where nodes are many, the text and type parts of the first layer are computed once per pair of
    type and label and gathered: equal to concatenating the 105 features of every node, without
    making them.

    Args:
        units: width of both layers, for each member of an ensemble.
        reads: groups of features beyond the paper's that are on.
        members: M, see `Encoder`.

    Source: paper appendices B and C.
    """

    def __init__(self, units: int, reads: Collection[str] = (), members: int = 1) -> None:
        super().__init__()
        num_features = TEXT_DIM + len(NODE_TYPES) + count_columns("node", reads)
        self.members = members
        self.first = Linear(num_features, members * units)
        self.second = make_linear(units, units, members)

    def forward(self, batch: Batch) -> Tensor:
        """Embed all nodes: (N, units), or (N, M, units) of several members."""
        sizes = [TEXT_DIM, NODE_FEATURE_DIM, len(NODE_TYPES)]
        sizes.append(self.first.weight.shape[1] - sum(sizes))
        text_weight, feature_weight, type_weight, more = self.first.weight.split(sizes, dim=1)
        of_type = type_weight.t()  # (5, M units)
        if not batch.text.shape[1] and not batch.node_feature.shape[1]:  # nodes of a type are alike
            return batch.repeat_per_node_type(self._embed(of_type + self.first.bias))
        text_weight = text_weight[:, : batch.text.shape[1]]
        if batch.num_nodes < len(of_type) * len(batch.text):  # of a single home
            text = batch.text.index_select(0, batch.label)  # often fewer than there are labels
            known = multiply(text, text_weight.t(), self.first.bias)  # (N, M units)
            known = known + batch.repeat_per_node_type(of_type)
        else:
            text = multiply(batch.text, text_weight.t(), self.first.bias)  # (L, M units)
            table = (of_type.unsqueeze(1) + text).flatten(0, 1)  # (5 L, M units)
            blocks = enumerate(batch.label.split(batch.node_counts))
            row = torch.cat([label + ntype * len(text) for ntype, label in blocks])  # (N,)
            known = table.index_select(0, row)
        if more.shape[1]:
            feature_weight = torch.cat([feature_weight, more], dim=1)
        feature_weight = feature_weight[:, : batch.node_feature.shape[1]]
        return self._embed(multiply(batch.node_feature, feature_weight.t(), known))

    def _embed(self, hidden: Tensor) -> Tensor:
        """Finish what the first layer has summed up, in place: (n, M units) -> (n, M, units)."""
        hidden = split_members(F.relu(hidden, inplace=True), self.members)
        return F.relu(self.second(hidden), inplace=True)


class EdgeEmbedding(nn.Module):
    """Two layers over [edge features (9 or more), relation one-hot (4)], ReLU after each.

    Args:
        units: width of both layers, for each member of an ensemble.
        reads: groups of features beyond the paper's that are on.
        members: M, see `Encoder`.

    Source: paper appendices B and C.
    """

    relation: Tensor

    def __init__(self, units: int, reads: Collection[str] = (), members: int = 1) -> None:
        super().__init__()
        num_features = count_columns("edge", reads) + len(RELATIONS)
        self.members = members
        self.first = Linear(num_features, members * units)
        self.second = make_linear(units, units, members)
        one_hot = torch.eye(len(RELATIONS))
        relation = torch.stack([one_hot[RELATIONS.index(name)] for _, name, _ in EDGE_TYPES])
        self.register_buffer("relation", relation, persistent=False)  # (10, 4)

    def forward(self, batch: Batch, edges: Tensor | None = None) -> Tensor:
        """Embed all edges, (E, units) or (E, M, units), or only `edges`, int64 (n,)."""
        features = torch.cat([batch.edge_feature, batch.repeat_per_edge_type(self.relation)], dim=1)
        if edges is not None:
            features = features.index_select(0, edges)
        hidden = split_members(F.relu(self.first(features), inplace=True), self.members)
        return F.relu(self.second(hidden), inplace=True)

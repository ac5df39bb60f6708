"""Embedding of the features of nodes and edges."""

from __future__ import annotations

from collections.abc import Collection

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import Batch
from datamodules.feature_config import NODE_FEATURE_DIM, TEXT_DIM, count_columns
from sgm.schema import EDGE_RELATIONS, EDGE_TYPES, NODE_TYPES


class FeatureEmbedding(nn.Module):
    """Two ReLU layers.

    Args:
        num_features: columns that the first one reads.
        units: width of both.
    """

    def __init__(self, num_features: int, units: int) -> None:
        super().__init__()
        self.first = nn.Linear(num_features, units)
        self.second = nn.Linear(units, units)

    def finish(self, hidden: Tensor) -> Tensor:
        """Finish what the first layer has summed up, in place: (n, units) -> (n, units)."""
        return F.relu(self.second(F.relu(hidden, inplace=True)), inplace=True)


class NodeEmbedding(FeatureEmbedding):
    """Two ReLU layers over [text (96), features (4), node type one-hot (5), more features].

    The last are those of groups beyond the paper's. Features that are switched off count as zeros.
    Where nodes are many, the text and type parts of the first layer are computed once per pair of
    type and label and gathered: equal to concatenating the 105 features of every node, without
    making them.

    Args:
        units: as for `FeatureEmbedding`.
        reads: groups of features beyond the paper's that are on.

    Source: paper appendices B and C.
    """

    def __init__(self, units: int, reads: Collection[str] = ()) -> None:
        super().__init__(TEXT_DIM + len(NODE_TYPES) + count_columns("node", reads), units)

    def forward(self, batch: Batch) -> Tensor:
        """Embed all nodes: (N, units)."""
        sizes = [TEXT_DIM, NODE_FEATURE_DIM, len(NODE_TYPES)]
        sizes.append(self.first.weight.shape[1] - sum(sizes))
        of_text, of_feature, of_type, of_more = self.first.weight.t().split(sizes)  # (., units)
        of_text = of_text[: batch.text.shape[1]]
        num_labels, node_type = len(batch.text), batch.node_type
        if len(node_type) < len(NODE_TYPES) * num_labels:  # of a single home
            known = torch.addmm(self.first.bias, batch.text.index_select(0, batch.label), of_text)
            known = known + of_type.index_select(0, node_type)  # (N, units)
        else:
            text = torch.addmm(self.first.bias, batch.text, of_text)  # (L, units)
            table = (of_type.unsqueeze(1) + text).flatten(0, 1)  # (5 L, units)
            known = table.index_select(0, batch.label + node_type * num_labels)
        of_feature = torch.cat([of_feature, of_more])[: batch.node_feature.shape[1]]
        return self.finish(torch.addmm(known, batch.node_feature, of_feature))


class EdgeEmbedding(FeatureEmbedding):
    """Two layers over [edge features (9 or more), relation one-hot (4)], ReLU after each.

    HEAT gives edge types and edge attributes widths of their own: `HEAT.edge_units`.

    Args:
        units: as for `FeatureEmbedding`.
        reads: groups of features beyond the paper's that are on.

    Source: paper appendices B and C.
    """

    relation: Tensor

    def __init__(self, units: int, reads: Collection[str] = ()) -> None:
        super().__init__(count_columns("edge", reads) + len(EDGE_RELATIONS), units)
        one_hot = torch.eye(len(EDGE_RELATIONS))
        relation = torch.stack([one_hot[EDGE_RELATIONS.index(name)] for _, name, _ in EDGE_TYPES])
        self.register_buffer("relation", relation, persistent=False)  # (10, 4)

    def forward(self, batch: Batch, edges: Tensor | None = None) -> Tensor:
        """Embed all edges, (E, units), or only `edges`, int64 (n,)."""
        feature, edge_type = batch.edge_feature, batch.edge_type
        if edges is not None:
            feature, edge_type = feature.index_select(0, edges), edge_type.index_select(0, edges)
        relation = self.relation.index_select(0, edge_type)
        return self.finish(self.first(torch.cat([feature, relation], dim=1)))

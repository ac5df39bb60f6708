"""Messages among furniture of one label in one room."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import EDGE_TYPES, Batch
from nep.layers.equal_rows import Linear
from nep.layers.segment import segment_sum

_ROOM_EDGES = EDGE_TYPES.index(("room", "contains", "furniture"))


class AlikeConv(nn.Module):
    r"""Each candidate place hears its like: the other candidates of its label in its room.

    .. math:: x'_i = x_i + \mathrm{ReLU}(W \mathrm{mean}_{j \in A(i)} x_j + b)

    Candidates are the furniture ends of query edges. Other nodes, and furniture without its like,
    stay as they are. After a convolution, x_j is what was seen at j: whether mugs were seen at the
    tables of this room, for a table where none was. The graph has no edges for this: with
    the rooms and labels a layer can make them, and no weight has another shape for it.

    Args:
        units: width of the nodes.

    Source: not in the paper (results/claims.md).
    """

    def __init__(self, units: int) -> None:
        super().__init__()
        self.weight = Linear(units, units)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Add what the like of each candidate has: (N, units) -> (N, units)."""
        first = sum(batch.edge_counts[:_ROOM_EDGES])
        rows = slice(first, first + batch.edge_counts[_ROOM_EDGES])
        room = torch.arange(batch.num_nodes, device=node.device)  # of its own, if it has no room
        room = room.index_copy(0, batch.edge_dst[rows], batch.edge_src[rows])
        place = batch.edge_dst.index_select(0, batch.query_edge).unique()  # (F,)
        kind = room[place] * len(batch.text) + batch.label[place]
        kinds, group = kind.unique(return_inverse=True)
        size = group.bincount(minlength=len(kinds))[group].unsqueeze(1)  # (F, 1)
        own = node.index_select(0, place)
        total = segment_sum(own, group, len(kinds)).index_select(0, group)
        heard = torch.relu(self.weight((total - own) / (size - 1).clamp(min=1)))
        return node.index_add(0, place, (heard * (size > 1)).to(node.dtype))

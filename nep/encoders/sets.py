"""Places compared with each other as a set: no messages along edges."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import Encoder, check_num_convolutions
from nep.layers.ensemble_linear import gelu, make_linear, split_members
from nep.layers.segment import segment_max, segment_sum


class Sets(Encoder):
    """Rounds of mean and maximum over the furniture nodes of each snapshot.

    Round k gives every furniture node i of a snapshot with the set S of them

        h_i <- gelu(U_k gelu(W_k h_i + V_k [mean_S h, max_S h])),

    and the last one adds h_i as it was before the first. Other nodes stay as they are. The order
    of places is of no account, and their number may be anything.

    Args:
        units: width of the node and edge embeddings.
        num_rounds: how often.
        members: M, networks in an ensemble.

    Source: Zaheer et al. 2017 (Deep Sets); Lakshminarayanan et al. 2017 (ensembles). Not in the
    paper.
    """

    num_hops = 0
    uses_edges = False

    def __init__(self, units: int = 64, num_rounds: int = 2, members: int = 1) -> None:
        super().__init__(units, members)
        check_num_convolutions(num_rounds)
        self.num_rounds = num_rounds
        rounds = range(num_rounds)
        self.own = nn.ModuleList(make_linear(units, units, members) for _ in rounds)
        self.shared = nn.ModuleList(
            make_linear(2 * units, units, members, bias=False) for _ in rounds
        )
        self.update = nn.ModuleList(make_linear(units, units, members) for _ in rounds)

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Encode the furniture nodes, (N, M, units) -> (N, M, units)."""
        places = batch.furniture
        first = hidden = node[places]
        snapshot = batch.node_snapshot[places]
        each_place = hidden.new_ones(len(hidden), 1)
        size = segment_sum(each_place, snapshot, batch.num_snapshots).clamp(min=1)
        for transform, shared, update in zip(self.own, self.shared, self.update, strict=True):
            columns = hidden.flatten(1)  # (NF, M units)
            mean = segment_sum(columns, snapshot, batch.num_snapshots) / size
            most = segment_max(columns, snapshot, batch.num_snapshots)
            both = [split_members(pooled, self.members) for pooled in (mean, most)]
            pooled = shared(torch.cat(both, dim=-1))  # (B, M, units)
            hidden = gelu(transform(hidden) + pooled.index_select(0, snapshot))
            hidden = gelu(update(hidden))
        return torch.cat([node[: places.start], hidden + first, node[places.stop :]])

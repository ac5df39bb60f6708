"""Places compared with each other as a set."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from nep.any_home.ensemble_linear import EnsembleLinear, gelu
from nep.training.segment import segment_max, segment_sum


class Sets(nn.Module):
    """Rounds of mean and maximum over the furniture nodes of each snapshot.

    Round k gives every furniture node i of a snapshot with the set S of them

        h_i <- gelu(U_k gelu(W_k h_i + V_k [mean_S h, max_S h])),

    and the last one adds h_i as it was before the first. The order of places is of no account, and
    their number may be anything.

    Args:
        units: D, width of the places.
        num_rounds: how often.
        members: M, networks in an ensemble.

    Source: Zaheer et al. 2017 (Deep Sets); Lakshminarayanan et al. 2017 (ensembles). Not in the
    paper.
    """

    def __init__(self, units: int, num_rounds: int, members: int) -> None:
        super().__init__()
        rounds = range(num_rounds)
        self.own = nn.ModuleList(EnsembleLinear(units, units, members) for _ in rounds)
        self.shared = nn.ModuleList(
            EnsembleLinear(2 * units, units, members, bias=False) for _ in rounds
        )
        self.update = nn.ModuleList(EnsembleLinear(units, units, members) for _ in rounds)

    def forward(self, places: Tensor, snapshot: Tensor, num_snapshots: int) -> Tensor:
        """Encode the furniture nodes: (NF, M, D), (NF,) -> (NF, M, D)."""
        hidden = places
        for transform, shared, update in zip(self.own, self.shared, self.update, strict=True):
            pooled = shared(pool(hidden, snapshot, num_snapshots))  # (B, M, D)
            hidden = gelu(transform(hidden) + pooled.index_select(0, snapshot))
            hidden = gelu(update(hidden))
        return hidden + places


def pool(places: Tensor, snapshot: Tensor, num_snapshots: int) -> Tensor:
    """Return mean and maximum over the places of each snapshot: (NF, M, D) -> (B, M, 2 D)."""
    columns = places.flatten(1)  # (NF, M D)
    size = segment_sum(columns.new_ones(len(columns), 1), snapshot, num_snapshots)
    mean = segment_sum(columns, snapshot, num_snapshots) / size.clamp(min=1)
    most = segment_max(columns, snapshot, num_snapshots)
    return torch.cat([pooled.unflatten(1, places.shape[1:]) for pooled in (mean, most)], dim=2)

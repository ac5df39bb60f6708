"""Attention among more query edges than can all attend to each other. Not in the paper."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

# Query edges that one attends to: all of them, up to here; of more, those that stand out and a
# sample of the others, so that time and memory grow with the number of places, not its square.
MOST_KEYS = 1024
_STAND_OUT = MOST_KEYS // 4


def choose_keys(query: Tensor) -> tuple[Tensor, Tensor]:
    """Choose which of many query edges the others attend to, `MOST_KEYS` of them.

    A quarter are those furthest from the mean, such as places where the object was seen. The others
    are evenly spread over the rest, and each counts for as many as it stands for.

    (Q, D), with Q above `MOST_KEYS`, -> rows and for how many each counts, (MOST_KEYS,) each.
    """
    distance = (query - query.mean(dim=0)).square().sum(dim=1).float()
    order = torch.sort(distance, descending=True, stable=True).indices
    ordinary = order[_STAND_OUT:].sort().values
    step = len(ordinary) / (MOST_KEYS - _STAND_OUT)
    spread = (torch.arange(MOST_KEYS - _STAND_OUT, device=query.device) * step).long()
    weight = torch.ones(MOST_KEYS, dtype=query.dtype, device=query.device)
    weight[_STAND_OUT:] = step
    return torch.cat([order[:_STAND_OUT], ordinary[spread]]), weight


def attend_apart(
    attend: Callable[[Tensor, Tensor, int], Tensor],
    query: Tensor,
    query_snapshot: Tensor,
    is_wide: Tensor,
) -> Tensor:
    """Attend in each wide snapshot (B,) by itself, and in all others together: (Q, D) -> (Q, D)."""
    group = torch.where(is_wide[query_snapshot], query_snapshot, -1)
    parts = [(group == number).nonzero().squeeze(1) for number in group.unique().tolist()]
    found = []
    for rows in parts:
        names, snapshot = query_snapshot[rows].unique(return_inverse=True)
        found.append(attend(query[rows], snapshot, len(names)))
    return torch.cat(found)[torch.cat(parts).argsort()]

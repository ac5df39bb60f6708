"""Class noise and instance noise: each home's own version of the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simulator.grouped import compute_rank_in_group


def compute_noisy_weights(
    weights: np.ndarray,
    uniform: np.ndarray,
    groups: Sequence[np.ndarray],
    *,
    zero_prob: float,
    scale: float,
    min_kept: int = 2,
) -> np.ndarray:
    """Zero some placement weights, scale the others, normalise per object.

    Args:
        weights: non-negative placement weights, (..., P).
        uniform: two independent uniforms per weight, (..., P, 2): one decides whether it is
            zeroed, one its scale.
        groups: index arrays that split the last axis by room; in each of them an object keeps
            at least `min_kept` of its places, because it moves among the places of one room.
        zero_prob: probability that a weight is zeroed.
        scale: surviving weights are multiplied by U(1 - scale, 1 + scale).
        min_kept: candidate places that survive per object and room, where there are that many.

    Returns:
        (..., P) weights that sum to one over P, or to zero where there was no weight at all.

    Source: paper appendix A, "Sampling noise"; rulings 5 and 6.
    """
    # An object has some five places of sixty-four: only these are worked on.
    place = np.flatnonzero(weights > 0)  # (k,) of all rows one after the other
    row, column = np.divmod(place, weights.shape[-1])
    draws, factor = uniform.reshape(-1, 2).take(place, axis=0).T  # (k,), (k,)
    kept = draws >= zero_prob
    room = np.full(weights.shape[-1], -1)
    for number, group in enumerate(groups):
        room[group] = number
    _keep_nearest(kept, draws, row * len(groups) + room[column], room[column] >= 0, min_kept)
    place, row, factor = place[kept], row[kept], factor[kept]
    noisy = np.zeros(weights.shape)
    noisy.ravel()[place] = weights.ravel()[place] * (1 - scale + 2 * scale * factor)
    total = noisy.sum(axis=-1).ravel()[row]
    noisy.ravel()[place[total > 0]] /= total[total > 0]
    return noisy


def _keep_nearest(
    kept: np.ndarray, draws: np.ndarray, group: np.ndarray, is_grouped: np.ndarray, min_kept: int
) -> None:
    """Keep those that came nearest to being kept, in place, where too few of a group are.

    Args:
        kept: bool (k,).
        draws: the higher, the nearer, (k,).
        group: (k,).
        is_grouped: whether it belongs to a group, bool (k,).
        min_kept: wanted per group.
    """
    num_kept = np.bincount(group[kept & is_grouped], minlength=int(group.max(initial=0)) + 1)
    short = np.flatnonzero(is_grouped & (num_kept[group] < min_kept))
    order = short[np.lexsort((-draws[short], group[short]))]
    rank = compute_rank_in_group(group[order])
    threshold = np.full(len(num_kept), -1.0)
    last = order[rank == min_kept - 1]
    threshold[group[last]] = draws[last]
    kept[short] |= draws[short] >= threshold[group[short]]

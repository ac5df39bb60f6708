"""Class noise and instance noise: each home's own version of the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


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
    is_place = weights > 0
    kept = is_place & (uniform[..., 0] >= zero_prob)
    for group in groups:
        draws = np.where(is_place[..., group], uniform[..., group, 0], -1.0)
        if draws.shape[-1] >= min_kept:
            threshold = np.partition(draws, -min_kept, axis=-1)[..., -min_kept, None]
        else:
            threshold = np.full((*draws.shape[:-1], 1), -1.0)
        kept[..., group] |= (draws >= threshold) & (draws >= 0)
    noisy = np.where(kept, weights * (1 - scale + 2 * scale * uniform[..., 1]), 0.0)
    total = noisy.sum(axis=-1, keepdims=True)
    return np.divide(noisy, total, out=np.zeros_like(noisy), where=total > 0)

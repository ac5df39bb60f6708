"""Hypothetical edges: where a query object may be although nobody has seen it there."""

from __future__ import annotations

import numpy as np


def propose_places(prior_rows: np.ndarray, threshold: float = 0.0) -> np.ndarray:
    """Mark the places that get a hypothetical edge.

    Every place whose prior weight exceeds the threshold; where the prior knows no place at all
    for an object, every furniture node (as "onTop"), so that no query is without candidates.

    Args:
        prior_rows: prior weight per place, (..., F, 2).
        threshold: 0 keeps everything the prior deems possible.

    Returns:
        bool (..., F, 2).

    Source: paper section 4.2, f_h; docs/design.md, ruling 12.
    """
    proposed = prior_rows > threshold
    is_known = proposed.any(axis=(-2, -1), keepdims=True)
    proposed[..., 1:] |= ~is_known
    return proposed


def sample_places(shape: tuple[int, ...], count: int, *, rng: np.random.Generator) -> np.ndarray:
    """Mark `count` furniture nodes at random, as "onTop": the ablation without a prior.

    Args:
        shape: (..., F).
        count: hypothetical edges per query, capped at F.
        rng: random numbers.

    Returns:
        bool (..., F, 2).

    Source: docs/design.md, ruling 13.
    """
    draws = rng.random(shape)
    count = min(count, shape[-1])
    chosen = draws <= np.partition(draws, count - 1, axis=-1)[..., count - 1 : count]
    return np.stack([np.zeros_like(chosen), chosen], axis=-1)

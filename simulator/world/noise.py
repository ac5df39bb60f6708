"""Class noise and instance noise: each home's own version of the prior."""

from __future__ import annotations

import numpy as np

from simulator.world.noise_kernel import add_noise

NUMBERS_AT_ONCE = 1 << 20  # random numbers of noise worked on together: 8 MB


def compute_noisy_weights(
    weights: np.ndarray,
    rows: np.ndarray,
    places: np.ndarray,
    uniform: np.ndarray,
    row_home: np.ndarray,
    place_room: np.ndarray,
    num_places: np.ndarray,
    *,
    zero_prob: np.ndarray,
    scale: np.ndarray,
    min_kept: int = 2,
) -> np.ndarray:
    """Zero some placement weights, scale the others, normalise per object.

    An object has some five places of sixty-four: only these are given.

    Args:
        weights: positive placement weights, those of an object beside each other, (k,).
        rows: the object of each weight, (k,).
        places: its place, ascending for an object, (k,).
        uniform: two independent uniforms per weight, (k, 2): one decides whether it is zeroed,
            one its scale.
        row_home: the home of each object, by which it has its rooms and shares of noise, (n,).
        place_room: room of every place, (H, P); in each of them an
            object keeps at least `min_kept` of its places, because it moves among the places of
            one room.
        num_places: places of each home, the first ones of its row, (H,).
        zero_prob: probability that a weight is zeroed, (H,).
        scale: surviving weights are multiplied by U(1 - scale, 1 + scale), (H,).
        min_kept: candidate places that survive per object and room, where there are that many.

    Returns:
        Weights that sum to one per object, or are all zero, (k,).

    Source: paper appendix A, "Sampling noise"; docs/design.md, rulings 5 and 6.
    """
    return add_noise(
        weights, rows, places, uniform, row_home, place_room, num_places, zero_prob, scale, min_kept
    )

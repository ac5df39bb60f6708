"""Class noise and instance noise: each home's own version of the prior."""

from __future__ import annotations

import numpy as np

from simulator.kernel import kernel

NUMBERS_AT_ONCE = 1 << 20  # random numbers of noise worked on together: 8 MB


@kernel
def compute_noisy_weights(
    weights: np.ndarray,
    rows: np.ndarray,
    places: np.ndarray,
    uniform: np.ndarray,
    row_home: np.ndarray,
    place_room: np.ndarray,
    num_place_codes: np.ndarray,
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
        uniform: (k, 2): one number decides whether the weight is zeroed, one its scale.
        row_home: the home of each object, by which it has its rooms and shares of noise, (n,).
        place_room: room of every place, (H, P).
        num_place_codes: codes of places of each home, the first ones of its row, (H,).
        zero_prob: probability that a weight is zeroed, (H,).
        scale: surviving weights are multiplied by U(1 - scale, 1 + scale), (H,).
        min_kept: places that survive per object and room, where there are that many: an object
            moves among the places of one room.

    Returns:
        Weights that sum to one per object, or are all zero, (k,).

    Source: paper appendix A, "Sampling noise"; docs/design.md, rulings 5 and 6.
    """
    noisy = np.zeros(len(rows))
    # A row as wide as its home, for the order in which it is summed up.
    whole = np.zeros(place_room.shape[1])
    start = 0
    while start < len(rows):
        object_row, end = rows[start], start
        home = row_home[object_row]
        rooms, own_zero_prob, own_scale = place_room[home], zero_prob[home], scale[home]
        while end < len(rows) and rows[end] == object_row:
            end += 1
        for i in range(start, end):
            own_room = rooms[places[i]]
            is_kept = uniform[i, 0] >= own_zero_prob
            if not is_kept:
                num_nearer = 0
                for j in range(start, end):
                    num_nearer += rooms[places[j]] == own_room and uniform[j, 0] > uniform[i, 0]
                    if num_nearer >= min_kept:
                        break
                is_kept = num_nearer < min_kept
            if is_kept:
                factor = 1 - own_scale + 2 * own_scale * uniform[i, 1]
                noisy[i] = weights[i] * factor
                whole[places[i]] = noisy[i]
        total = sum_pairwise(whole[: num_place_codes[home]])
        for i in range(start, end):
            whole[places[i]] = 0
            if total > 0:
                noisy[i] /= total
        start = end
    return noisy


@kernel
def list_positive(
    weights: np.ndarray, sources: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List positive weights (m, P) of rows `sources` (n,): row 0..n - 1, place and value, (k,)."""
    most = len(sources) * weights.shape[1] + 1
    rows, places = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    values = np.empty(most)
    # Ask for the memory of all rows at once, instead of row after row, as for a draw from T
    # (`benchmarks/evolve.py`); no sum is negative.
    total = 0.0
    for source in range(len(sources)):
        for place in range(0, weights.shape[1], 16):
            total += weights[sources[source], place]
    end = 0
    for source in range(len(sources) if total >= 0 else 0):
        for place in range(weights.shape[1]):
            rows[end], places[end] = source, place
            values[end] = weights[sources[source], place]
            end += values[end] > 0
    return rows[:end], places[:end], values[:end]


@kernel
def sum_pairwise(numbers: np.ndarray) -> float:
    """Add numbers (n,) in the order that numpy adds a row of doubles, so that bits are the same."""
    count = len(numbers)
    if count < 8:
        total = 0.0
        for i in range(count):
            total += numbers[i]
        return total
    if count <= 128:
        a, b, c, d = numbers[0], numbers[1], numbers[2], numbers[3]
        e, f, g, h = numbers[4], numbers[5], numbers[6], numbers[7]
        whole = count - count % 8
        for i in range(8, whole, 8):
            a += numbers[i]
            b += numbers[i + 1]
            c += numbers[i + 2]
            d += numbers[i + 3]
            e += numbers[i + 4]
            f += numbers[i + 5]
            g += numbers[i + 6]
            h += numbers[i + 7]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
        for i in range(whole, count):
            total += numbers[i]
        return total
    half = count // 2
    half -= half % 8
    return sum_pairwise(numbers[:half]) + sum_pairwise(numbers[half:])

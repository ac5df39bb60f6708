"""Class noise and instance noise of many rows of weights."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def list_positive(
    weights: np.ndarray, sources: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List the positive weights of some rows, row after row.

    Args:
        weights: (m, P).
        sources: which of the m rows, (n,).

    Returns:
        Their rows, 0..n - 1, their places and their values, (k,) each.
    """
    most = len(sources) * weights.shape[1] + 1
    rows, places = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    values = np.empty(most)
    # Ask for the memory of all rows at once, instead of row after row, as for a draw from T
    # (`benchmarks/evolve.py`); no sum is negative.
    total = 0.0
    for row in range(len(sources)):
        for place in range(0, weights.shape[1], 16):
            total += weights[sources[row], place]
    end = 0
    for row in range(len(sources) if total >= 0 else 0):
        for place in range(weights.shape[1]):
            rows[end], places[end] = row, place
            values[end] = weights[sources[row], place]
            end += values[end] > 0
    return rows[:end], places[:end], values[:end]


@kernel
def add_noise(
    weights: np.ndarray,
    rows: np.ndarray,
    places: np.ndarray,
    uniform: np.ndarray,
    row_home: np.ndarray,
    place_room: np.ndarray,
    num_places: np.ndarray,
    zero_probs: np.ndarray,
    scales: np.ndarray,
    min_kept: int,
) -> np.ndarray:
    """Zero some weights, scale the others, normalise per row.

    See `simulator.world.noise.compute_noisy_weights`.
    """
    noisy = np.zeros(len(rows))
    # A row as wide as its home, for the order in which it is summed up.
    whole = np.zeros(place_room.shape[1])
    start = 0
    while start < len(rows):
        row, end = rows[start], start
        home = row_home[row]
        rooms, zero_prob, scale = place_room[home], zero_probs[home], scales[home]
        while end < len(rows) and rows[end] == row:
            end += 1
        for i in range(start, end):
            own_room = rooms[places[i]]
            is_kept = uniform[i, 0] >= zero_prob
            if not is_kept:
                num_nearer = 0
                for j in range(start, end):
                    num_nearer += rooms[places[j]] == own_room and uniform[j, 0] > uniform[i, 0]
                    if num_nearer >= min_kept:
                        break
                is_kept = num_nearer < min_kept
            if is_kept:
                factor = 1 - scale + 2 * scale * uniform[i, 1]
                noisy[i] = weights[i] * factor
                whole[places[i]] = noisy[i]
        total = sum_pairwise(whole[: num_places[home]])
        for i in range(start, end):
            whole[places[i]] = 0
            if total > 0:
                noisy[i] /= total
        start = end
    return noisy


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

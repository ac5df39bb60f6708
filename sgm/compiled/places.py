"""The places of a question in the order of a value, and summed up by room."""

from __future__ import annotations

import numpy as np

from sgm.compiled.kernel import kernel


@kernel
def rank_places(values: np.ndarray) -> np.ndarray:
    """Return 1 / rank of each place, the highest value 1, ties in order, float64 (Q, F)."""
    ranks = np.empty(values.shape)
    for query in range(len(values)):
        order = np.argsort(-values[query], kind="mergesort")
        for number in range(len(order)):
            ranks[query, order[number]] = 1 / (number + 1)
    return ranks


@kernel
def sum_by_room(room: np.ndarray, num_rooms: int, values: np.ndarray) -> np.ndarray:
    """Return the sum over the room of each place, float64 (Q, F).

    Args:
        room: of each place, -1 for what is no place, which counts as a room, (Q, F).
        num_rooms: room numbers are below it.
        values: float64 (Q, F).
    """
    sums = np.empty(values.shape)
    total = np.empty(num_rooms + 1)
    for query in range(len(values)):
        total[:] = 0
        for place in range(values.shape[1]):
            total[room[query, place]] += values[query, place]  # -1 is the last
        for place in range(values.shape[1]):
            sums[query, place] = total[room[query, place]]
    return sums

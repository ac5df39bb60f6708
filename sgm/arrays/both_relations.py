"""All relations of a place taken together; numpy's own reductions take a call for each place."""

from __future__ import annotations

from functools import reduce

import numpy as np


def max_relations(values: np.ndarray) -> np.ndarray:
    """Return the highest value of each place, (..., relations) -> (...)."""
    return reduce(np.maximum, (values[..., number] for number in range(values.shape[-1])))


def sum_relations(values: np.ndarray) -> np.ndarray:
    """Return the sum of the values of each place, (..., relations) -> (...)."""
    return reduce(np.add, (values[..., number] for number in range(values.shape[-1])))


def share_relations(values: np.ndarray) -> np.ndarray:
    """Return values as shares of their sum at each place, alike where it is 0, (..., relations)."""
    total = sum_relations(values)[..., None]
    return np.where(total > 0, values / np.where(total > 0, total, 1), 1 / values.shape[-1])


def choose_relations(values: np.ndarray, *, last: bool = False) -> np.ndarray:
    """Return the relation of the highest value at each place, int64 (..., relations) -> (...).

    Of equal values, the first, or the `last`.
    """
    highest, chosen = values[..., 0], np.zeros(values.shape[:-1], dtype=np.int64)
    for number in range(1, values.shape[-1]):
        value = values[..., number]
        is_higher = value >= highest if last else value > highest
        highest, chosen = np.maximum(value, highest), np.where(is_higher, number, chosen)
    return chosen

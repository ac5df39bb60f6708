"""Both relations of a place taken together; numpy's own reductions take a call for each pair."""

from __future__ import annotations

import numpy as np


def max_relations(values: np.ndarray) -> np.ndarray:
    """Return the higher value of each place, (..., 2) -> (...)."""
    return np.maximum(values[..., 0], values[..., 1])


def sum_relations(values: np.ndarray) -> np.ndarray:
    """Return the sum of the values of each place, (..., 2) -> (...)."""
    return values[..., 0] + values[..., 1]


def share_relations(values: np.ndarray) -> np.ndarray:
    """Return values as shares of their sum at each place, one half where it is 0, (..., 2)."""
    total = sum_relations(values)[..., None]
    return np.where(total > 0, values / np.where(total > 0, total, 1), 0.5)

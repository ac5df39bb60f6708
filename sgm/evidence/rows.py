"""Sums, ranks and logarithms of the rows of a matrix, the same whatever stands beside them."""

from __future__ import annotations

import numpy as np

_FEW_KEYS = 100  # for each value: a count of all is sooner made than the values are sorted
_LEAST_SHARE = 0.02  # of a share times the number of places, in logarithms


def add_in_order(values: np.ndarray) -> np.ndarray:
    """Sum along the last axis, (..., F) -> (..., 1), from first to last.

    Zeros behind the end of a row change no bit of its sum, so that it does not depend on the
    longest row beside it. `sum` adds in pairs and is rounded by the number of columns.
    """
    return np.add.accumulate(values, axis=-1)[..., -1:]


def sum_equal(key: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sum the values of a row that have the same key, at each of them, (Q, F), (Q, F) -> (Q, F).

    Keys are whole numbers of at least -1.
    """
    num_keys = int(key.max(initial=0)) + 2
    number = (key + (np.arange(len(key)) * num_keys + 1)[:, None]).ravel()
    if num_keys * len(key) > _FEW_KEYS * key.size:
        number = np.unique(number, return_inverse=True)[1].ravel()
    return np.bincount(number, values.ravel())[number].reshape(key.shape)


def rank_rows(values: np.ndarray) -> np.ndarray:
    """Return 1 / rank within rows, the highest value 1, ties in order, (Q, F) -> (Q, F)."""
    order = (-values).argsort(axis=1, kind="stable")
    ranks = np.empty(values.shape)
    ranks[np.arange(len(values))[:, None], order] = 1 / np.arange(1.0, values.shape[1] + 1)
    return ranks


def log_share(share: np.ndarray, num_places: np.ndarray) -> np.ndarray:
    """Return logarithms of shares of places, (Q, F), 0 for an even one of so many places, (Q,)."""
    return np.log(share * num_places[:, None] + _LEAST_SHARE)

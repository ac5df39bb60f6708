"""Sums, ranks and logarithms of the rows of a matrix, the same whatever stands beside them."""

from __future__ import annotations

import numpy as np

_FEW_KEYS = 100  # for each value: a count of all is sooner made than the values are sorted
_LEAST_SHARE = 0.02  # of a share times the number of places, in logarithms
_TIE_DECIMALS = 9  # sums in another order are rounded otherwise: such values are equal


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


def rank_rows(values: np.ndarray, is_place: np.ndarray) -> np.ndarray:
    """Return 1 / rank among the places of a row, the highest value 1, (Q, F) -> (Q, F).

    Equal values share the mean of what their ranks give, so that the order of places says nothing.
    What is no place, bool (Q, F), comes last.
    """
    values = np.where(is_place, values, -np.inf).round(_TIE_DECIMALS)
    order = (-values).argsort(axis=1, kind="stable")
    order += (np.arange(len(values)) * values.shape[1])[:, None]
    order = order.ravel()
    in_order = values.ravel()[order].reshape(values.shape)
    begins = np.ones(values.shape, dtype=bool)
    np.not_equal(in_order[:, 1:], in_order[:, :-1], out=begins[:, 1:])
    first = np.flatnonzero(begins)  # of each group of equal values
    number = np.diff(first, append=values.size)
    inverse = np.tile(1 / np.arange(1.0, values.shape[1] + 1), len(values))
    ranks = np.empty(values.size)
    ranks[order] = np.repeat(np.add.reduceat(inverse, first) / number, number)
    return ranks.reshape(values.shape)


def share_most(values: np.ndarray) -> np.ndarray:
    """Return 1 at the highest value of a row, else 0; equal ones share it, (Q, F) -> (Q, F)."""
    is_most = values == values.max(axis=1, keepdims=True)
    return is_most / is_most.sum(axis=1, keepdims=True)


def log_share(share: np.ndarray, num_places: np.ndarray) -> np.ndarray:
    """Return logarithms of shares of places, (Q, F), 0 for an even one of so many places, (Q,)."""
    return np.log(share * num_places[:, None] + _LEAST_SHARE)

"""Rows that are filled up to equal length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def sum_rows(values: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Sum the first entries of rows, as many as each has, (n, ..., F), (n,) -> (n, ...).

    The others may be zero, but not even they may be added: how a sum is rounded depends on the
    length of the row, and so on the longest row beside it.
    """
    if (lengths == values.shape[-1]).all():
        return np.ascontiguousarray(values).sum(axis=-1)
    total = np.zeros(values.shape[:-1], dtype=values.dtype)
    for length in np.unique(lengths):
        rows = lengths == length
        total[rows] = np.ascontiguousarray(values[rows, ..., :length]).sum(axis=-1)
    return total


def pad_rows(rows: Sequence[Sequence[Any] | np.ndarray], fill: object, dtype: Any) -> np.ndarray:
    """Put H rows of up to W values into one array, (H, W), with `fill` beyond the end of each."""
    padded = np.full((len(rows), max(map(len, rows), default=0)), fill, dtype=dtype)
    for own, row in zip(padded, rows, strict=True):
        own[: len(row)] = row
    return padded

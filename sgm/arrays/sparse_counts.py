"""Counts of rows and columns, most of them 0, as JSON values."""

from __future__ import annotations

from typing import Any

import numpy as np


def write_sparse(counts: np.ndarray) -> list[list[int]]:
    """Return rows, columns and values of what is not 0 of counts with two axes, three lists."""
    places = np.nonzero(counts)
    written: list[list[int]] = np.stack([*places, counts[places]]).tolist()
    return written


def read_sparse(name: str, values: Any, limits: tuple[int, int, int]) -> np.ndarray:
    """Read what `write_sparse` returned, int64 (3, n); rows, columns and counts are below `limits`.

    Raises:
        ValueError: if they are none, or out of range; named as `name`.
    """
    array = np.array(values)
    if array.size == 0:
        array = np.zeros((3, 0), dtype=np.int64)
    if array.ndim != 2 or len(array) != 3 or array.dtype != np.int64:
        raise ValueError(
            f"{name} must hold whole numbers: rows, columns and counts, got other values"
        )
    for part, limit in zip(array, limits, strict=True):
        if part.size and not (part.min() >= 0 and part.max() < limit):
            raise ValueError(f"{name} must lie in 0 to {limit - 1}, got {part.max()}")
    return array

"""Arrays of numbers that a caller or a file gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from sgm.messages import shorten


def read_numbers(name: str, values: Any, *shapes: tuple[int, ...]) -> np.ndarray:
    """Return finite numbers of one of some shapes, as an array of their own.

    Raises:
        ValueError: if they are something else; named as `name`.
    """
    try:
        read = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        read = np.empty(0)
    if read.shape not in shapes or not np.isfinite(read).all():
        shown = values.tolist() if isinstance(values, np.ndarray) else values
        raise ValueError(
            f"{name} must be finite numbers of shape {' or '.join(map(str, shapes))}, got "
            f"{shorten(shown)}. Check where it comes from."
        )
    return read


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

"""Rows of different lengths in one array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def pad_rows(rows: Sequence[Sequence[Any] | np.ndarray], fill: object, dtype: Any) -> np.ndarray:
    """Put H rows of up to W values into one array, (H, W), with `fill` beyond the end of each."""
    padded = np.full((len(rows), max(map(len, rows), default=0)), fill, dtype=dtype)
    for own, row in zip(padded, rows, strict=True):
        own[: len(row)] = row
    return padded

"""Arrays of numbers that a caller gives."""

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

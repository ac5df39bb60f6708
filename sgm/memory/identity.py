"""What tells one thing from others of its description: ids and embeddings, and their check."""

from __future__ import annotations

from typing import Any

import numpy as np

from sgm.messages import shorten
from sgm.names.words import MAX_LENGTH

MOST_NUMBERS = 4096  # of an embedding


def read_id(value: Any) -> str:
    """Return the id of a thing as text; trackers may count.

    Raises:
        ValueError: if it is empty, too long, or no text or whole number.
    """
    is_number = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    text = str(value) if is_number else value
    if not isinstance(text, str) or not text.isprintable() or not 0 < len(text) <= MAX_LENGTH:
        raise ValueError(
            f"id must be a text of 1 to {MAX_LENGTH} characters or a whole number, got "
            f"{shorten(value)}. Give the id that your tracker gives."
        )
    return text


def read_embedding(values: Any) -> tuple[float, ...]:
    """Return an embedding as numbers; empty without one.

    Raises:
        ValueError: if it is no row of finite numbers, or none of them is other than 0.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros((1, 1))
    is_row = array.ndim == 1 and len(array) <= MOST_NUMBERS and bool(np.isfinite(array).all())
    if not is_row or (len(array) and not array.any()):
        raise ValueError(
            f"embedding must be a row of at most {MOST_NUMBERS} finite numbers, not all 0, got "
            f"{shorten(values)}. Give one vector for each sighting."
        )
    return tuple(array.tolist())

"""What a memory keeps of one object beside numbers: its names, and what was said of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sgm.memory.statement import MOST_KEPT, Statement
from sgm.messages import shorten
from sgm.names.words import MAX_LENGTH

MOST_NUMBERS = 4096  # of an embedding


@dataclass(frozen=True, slots=True)
class Thing:
    """One object node.

    Attributes:
        description: in words, as first written.
        id: of a tracker or of re-identification, by which it is told from others of its
            description; empty where words alone tell things apart.
        statements: what was said of it, and done with it, the latest last.
        embedding: how it looks to whoever gave the id, (D,); empty if nobody said.
    """

    description: str
    id: str = ""
    statements: tuple[Statement, ...] = ()
    embedding: tuple[float, ...] = ()

    def add(self, statement: Statement) -> Thing:
        """Return it with one statement more; the oldest of too many is left out."""
        return replace(self, statements=(*self.statements, statement)[-MOST_KEPT:])

    def leave_out(self, furniture: Collection[int]) -> Thing:
        """Return it in a home without some furniture."""
        if not self.statements:
            return self
        left = (statement.leave_out(furniture) for statement in self.statements)
        return replace(self, statements=tuple(one for one in left if one is not None))


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

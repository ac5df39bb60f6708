"""A room and a piece of furniture, for memories, logs and traces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sgm.messages import shorten


@dataclass(frozen=True, slots=True)
class Room:
    """A room.

    Attributes:
        label: what kind of room it is, such as "bedroom".
        name: tells it from the other rooms, such as "bedroom 2"; empty where its id does.
    """

    label: str
    name: str = ""

    def __str__(self) -> str:
        """Return what people call it."""
        return self.name or self.label


@dataclass(frozen=True, slots=True)
class Furniture:
    """A furniture node.

    What it may have besides a label, a room and a description is the last fields, None where nobody
    knows: they are read and written here (`from_row`, `to_row`), for memory files and logs.

    Attributes:
        label: what it is, such as "fridge".
        room: id of its room.
        description: for people, such as "white fridge".
        name: tells it from all other furniture of the home, such as "shelf 2"; empty where its id
            does.
        position: where one stands to look at it, in metres; None if nobody knows.
    """

    label: str
    room: int
    description: str
    name: str = ""
    position: tuple[float, float] | None = None

    def to_row(self) -> list[Any]:
        """Return JSON values, without the last ones that nobody knows; names are in no row."""
        row = [self.label, self.room, self.description, self.position and list(self.position)]
        while row[-1] is None:
            row.pop()
        return row

    @classmethod
    def from_row(cls, label: str, room: int, description: str, position: Any = None) -> Furniture:
        """Read JSON values.

        Raises:
            ValueError: if the position is no two numbers.
        """
        return cls(label, room, description, position=read_position(position))


def read_position(position: Any = None) -> tuple[float, float] | None:
    """Return a position as two floats; None stays None.

    Raises:
        ValueError: if it is no two finite numbers.
    """
    if position is None:
        return None
    try:
        x, y = (float(value) for value in position)
    except (TypeError, ValueError, OverflowError):
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(
            f"position must be two numbers, got {shorten(position)}. Give metres, such as (1.5, 4)."
        )
    return x, y

"""A home on a grid: walls, doors, rooms and furniture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class GridFurniture:
    """A furniture node and the rectangle of cells that it stands on."""

    label: str
    column: int
    row: int
    width: int
    height: int

    @property
    def cells(self) -> list[tuple[int, int]]:
        """Its (column, row) cells, row after row."""
        return [
            (self.column + x, self.row + y) for y in range(self.height) for x in range(self.width)
        ]


@dataclass(frozen=True, slots=True)
class GridLayout:
    """A home of Y x X cells with R rooms and F furniture nodes.

    Attributes:
        rooms: labels, (R,).
        is_wall, is_door: bool (Y, X).
        room: room index of each floor cell, also under furniture; -1 on walls and doors, (Y, X).
        furniture: room after room, (F,).
        furniture_room: room index of each furniture node, (F,).
        furniture_at: furniture index on each cell, -1 for none, (Y, X).
        start: (column, row) where the agent stands at first.
    """

    rooms: tuple[str, ...]
    is_wall: np.ndarray
    is_door: np.ndarray
    room: np.ndarray
    furniture: tuple[GridFurniture, ...]
    furniture_room: np.ndarray
    furniture_at: np.ndarray
    start: tuple[int, int]

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.room.shape[1], self.room.shape[0]

    @property
    def is_free(self) -> np.ndarray:
        """Cells that the agent can stand on: floor and doors without furniture, bool (Y, X)."""
        return ~self.is_wall & (self.furniture_at < 0)

    @property
    def places(self) -> list[tuple[str, str]]:
        """(room, label) of every furniture node, as `SampledHomes` takes its layout, (F,)."""
        return [
            (self.rooms[room], piece.label)
            for room, piece in zip(self.furniture_room, self.furniture, strict=True)
        ]

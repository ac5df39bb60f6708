"""A home on a grid: walls, doors, rooms and furniture, and whether an agent can live in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage


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


def check_layout(layout: GridLayout) -> None:
    """Raise ValueError unless the home is closed, every room has a door, and all is in reach."""
    if len(set(layout.rooms)) < len(layout.rooms):
        raise ValueError(
            f"rooms must have different names, got {', '.join(layout.rooms)}. Rename one."
        )
    _check_border(layout)
    _check_doors(layout)
    x, y = layout.start
    columns, rows = layout.size
    if not (x < columns and y < rows and layout.is_free[y, x]):
        raise ValueError(
            f"start must be a free cell, got column {x}, row {y}, which is "
            f"{_describe(layout, x, y)}. Choose a floor cell without furniture."
        )
    areas, _ = ndimage.label(layout.is_free)  # connected through sides, (Y, X)
    is_reachable = areas == areas[y, x]
    _check_rooms(layout, is_reachable)
    for index, piece in enumerate(layout.furniture):
        if not (find_beside(layout, index) & is_reachable).any():
            raise ValueError(
                f"furniture must be reachable, got no way from the start to a free cell beside "
                f"'{piece.label}' at column {piece.column}, row {piece.row}. "
                "Leave a free floor cell next to it."
            )


def find_beside(layout: GridLayout, furniture: int) -> np.ndarray:
    """Mark the free floor cells that share a side with a furniture node, bool (Y, X)."""
    grown = ndimage.binary_dilation(layout.furniture_at == furniture)
    return grown & layout.is_free & ~layout.is_door


def _check_border(layout: GridLayout) -> None:
    is_border = np.ones(layout.room.shape, dtype=bool)
    is_border[1:-1, 1:-1] = False
    gaps = np.argwhere(is_border & ~layout.is_wall)
    if len(gaps):
        y, x = gaps[0]
        raise ValueError(
            f"border must be wall all round, got {_describe(layout, x, y)} at column {x}, "
            f"row {y}. Close it with '#'."
        )


def _check_doors(layout: GridLayout) -> None:
    """Every door joins two free floor cells on opposite sides."""
    is_floor = layout.is_free & ~layout.is_door
    for y, x in np.argwhere(layout.is_door):
        sides = [((x - 1, y), (x + 1, y)), ((x, y - 1), (x, y + 1))]
        if any(all(is_floor[b, a] for a, b in pair) for pair in sides):
            continue
        blocked = [
            f"{_describe(layout, a, b)} at column {a}, row {b}"
            for pair in sides
            for a, b in pair
            if not is_floor[b, a]
        ]
        raise ValueError(
            f"door must have free floor on two opposite sides, got none for the door at column "
            f"{x}, row {y}: {'; '.join(blocked)}. Move the door or the furniture."
        )


def _check_rooms(layout: GridLayout, is_reachable: np.ndarray) -> None:
    for index, name in enumerate(layout.rooms):
        cells = np.argwhere(layout.room == index)
        if len(cells) == 0:
            raise ValueError(
                f"room must have cells, got none for '{name}'. Draw it in the map, or remove it."
            )
        if not (is_reachable & (layout.room == index)).any():
            y, x = cells[0]
            raise ValueError(
                f"room must be joined to the start by doors, got no door that leads to '{name}' "
                f"at column {x}, row {y}. Put a '+' into one of its walls."
            )
        if not (layout.furniture_room == index).any():
            raise ValueError(
                f"room must have furniture, got none in '{name}'. Add some, or remove the room."
            )


def _describe(layout: GridLayout, x: int, y: int) -> str:
    """Say what is on a cell."""
    columns, rows = layout.size
    if x >= columns or y >= rows:
        return "outside the map"
    if layout.is_wall[y, x]:
        return "a wall"
    if layout.furniture_at[y, x] >= 0:
        return f"'{layout.furniture[layout.furniture_at[y, x]].label}'"
    return "a door" if layout.is_door[y, x] else "floor"

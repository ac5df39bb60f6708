"""Whether an agent can live in a layout: closed walls, doors, furniture within reach."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from simulator.igridson.layout import GridLayout


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

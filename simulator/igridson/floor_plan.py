"""The floor plan of a grid home, for the drawings of `simulator.drawing`."""

from __future__ import annotations

import numpy as np

from simulator.drawing.floor_plan import FloorPlan
from simulator.igridson.layout import GridLayout
from simulator.trace.layout import number_names

SIZE = 1.4  # cells; most furniture is two cells wide and one deep


def make_plan(layout: GridLayout) -> FloorPlan:
    """Return rooms and furniture as they stand on the grid, a cell one unit, rows from the top."""
    rows = layout.size[1]
    boxes = np.zeros((len(layout.rooms), 4))
    for room in range(len(layout.rooms)):
        (top, left), (bottom, right) = _find_extent(layout.room == room)
        boxes[room] = left, rows - bottom - 1, right - left + 1, bottom - top + 1
    corner = np.array(
        [
            (piece.column + piece.width / 2, rows - piece.row - piece.height / 2)
            for piece in layout.furniture
        ]
    )
    corner -= SIZE / 2
    footprints = np.array(
        [
            [(x, rows - y), (x, rows - y - tall), (x + wide, rows - y - tall), (x + wide, rows - y)]
            for x, y, wide, tall in (
                (piece.column, piece.row, piece.width, piece.height) for piece in layout.furniture
            )
        ],
        dtype=float,
    )
    door_rows, door_columns = np.nonzero(layout.is_door)
    return FloorPlan(
        rooms=layout.rooms,
        furniture=tuple(number_names([piece.label for piece in layout.furniture])),
        furniture_ids=tuple(range(len(layout.furniture))),
        furniture_room=np.asarray(layout.furniture_room),
        room_box=boxes,
        corner=corner,
        size=SIZE,
        has_positions=True,
        footprints=footprints,
        doors=np.column_stack([door_columns + 0.5, rows - door_rows - 0.5]),
    )


def _find_extent(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and last (row, column) of a mask (Y, X)."""
    found = np.argwhere(cells)
    return found.min(axis=0), found.max(axis=0)

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
        cells = np.argwhere(layout.room == room)
        low, high = cells.min(axis=0), cells.max(axis=0) + 1  # row, column
        boxes[room] = low[1], rows - high[0], high[1] - low[1], high[0] - low[0]
    pieces = layout.furniture
    left, wide = np.array([(piece.column, piece.width) for piece in pieces], dtype=float).T
    top, tall = np.array([(rows - piece.row, piece.height) for piece in pieces], dtype=float).T
    right, bottom = left + wide, top - tall
    corners = [(left, top), (left, bottom), (right, bottom), (right, top)]
    door_rows, door_columns = np.nonzero(layout.is_door)
    return FloorPlan(
        rooms=layout.rooms,
        furniture=tuple(number_names([piece.label for piece in pieces])),
        furniture_ids=tuple(range(len(pieces))),
        furniture_room=np.asarray(layout.furniture_room),
        room_box=boxes,
        corner=np.column_stack([left + wide / 2, top - tall / 2]) - SIZE / 2,
        size=SIZE,
        has_positions=True,
        footprints=np.array(corners).transpose(2, 0, 1),
        doors=np.column_stack([door_columns + 0.5, rows - door_rows - 0.5]),
    )

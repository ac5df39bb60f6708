"""Which cell of its furniture each object lies on."""

from __future__ import annotations

import numpy as np

from simulator.igridson.layout import GridLayout
from simulator.world.homes import Homes


class GridPlacement:
    """The cells of the objects of one home.

    An object that arrives at a furniture node takes its emptiest cell (the first of these) and
    keeps it until the object moves on.

    Attributes:
        cell: (column, row) of each object slot, -1 for an empty slot, (C, 2).
        furniture: furniture index of each object slot, -1 for an empty slot, (C,).
    """

    def __init__(self, layout: GridLayout, homes: Homes) -> None:
        self._cells = [np.array(piece.cells) for piece in layout.furniture]
        self.cell = np.full((homes.num_slots, 2), -1)
        self.furniture = np.full(homes.num_slots, -1)
        self.update(homes)

    def update(self, homes: Homes) -> None:
        """Follow the objects that have moved, left or come."""
        now = homes.object_furniture[0]
        moved = np.flatnonzero(now != self.furniture)
        self.furniture[moved] = -1
        self.cell[moved] = -1
        for slot in moved[now[moved] >= 0]:
            cells = self._cells[now[slot]]  # (k, 2)
            here = self.cell[self.furniture == now[slot]]
            load = (here[:, None] == cells).all(axis=2).sum(axis=0)
            self.cell[slot] = cells[np.argmin(load)]
            self.furniture[slot] = now[slot]

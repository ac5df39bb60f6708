"""Where the objects of a grid home lie, and what a picture shows of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.schema import INSIDE, PlaceCode
from simulator.igridson.layout import GridLayout
from simulator.world.homes import Homes

Color = tuple[int, int, int]
# Objects without a colour word in their description take one of these by type.
NEUTRALS: tuple[Color, ...] = (
    (122, 134, 150), (150, 128, 106), (108, 142, 128), (146, 120, 144), (136, 136, 96),
)  # fmt: skip
COLOR_WORDS: dict[str, Color] = {
    "black": (40, 40, 44), "blue": (58, 112, 214), "brown": (132, 86, 48),
    "copper": (184, 115, 51), "golden": (212, 168, 40), "green": (60, 152, 74),
    "grey": (140, 144, 150), "orange": (238, 140, 40), "pink": (236, 142, 176),
    "red": (208, 52, 48), "silver": (176, 182, 190), "white": (250, 250, 250),
    "yellow": (236, 206, 56),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class GridThing:
    """An object as a picture shows it.

    Attributes:
        cell: (column, row).
        is_inside: in its furniture (a ring) rather than on top of it (a disc).
        color: of the disc or ring.
        is_asked: whether it is asked for (a star).
    """

    cell: tuple[int, int]
    is_inside: bool
    color: Color
    is_asked: bool


@dataclass(frozen=True, slots=True)
class GridScene:
    """What one picture shows.

    Attributes:
        position: (column, row) of the agent.
        direction: index into `navigation.DIRECTIONS`.
        things: the objects.
        trail: cells walked over in this search, in order.
        looked_at: furniture looked at in this search.
        is_found: whether the last of them held the object.
        belief: probability per furniture node, or None, (F,).
        title, note: caption, left and right.
    """

    position: tuple[int, int]
    direction: int
    things: tuple[GridThing, ...] = ()
    trail: tuple[tuple[int, int], ...] = ()
    looked_at: tuple[int, ...] = ()
    is_found: bool = False
    belief: np.ndarray | None = None
    title: str = ""
    note: str = ""


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
            taken = self.cell[self.furniture == now[slot]]
            load = (taken[:, None] == cells).all(axis=2).sum(axis=0)
            self.cell[slot] = cells[np.argmin(load)]
            self.furniture[slot] = now[slot]


def list_things(homes: Homes, placement: GridPlacement, asked_code: int) -> tuple[GridThing, ...]:
    """List the objects of the first home as pictures show them."""
    things = []
    for slot in np.flatnonzero(homes.is_present[0]):
        code = int(homes.object_code[0, slot])
        words = homes.object_descriptions.text(code).split()
        named = [COLOR_WORDS[word] for word in words if word in COLOR_WORDS]
        neutral = NEUTRALS[int(homes.object_type[0, slot]) % len(NEUTRALS)]
        x, y = placement.cell[slot]
        things.append(
            GridThing(
                cell=(int(x), int(y)),
                is_inside=PlaceCode.relation(int(homes.object_place[0, slot])) == INSIDE,
                color=named[0] if named else neutral,
                is_asked=code == asked_code,
            )
        )
    return tuple(things)

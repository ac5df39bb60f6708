"""Rooms of symbolic ProcTHOR houses: their sizes, and the free floor left in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from tools.priors.procthor_rules import (
    CELL_SIZE,
    CELLS_PER_ROOM,
    DOOR_SIZE,
    HOUSE_SPECS,
    MAX_CUT,
    MIN_RECTANGLE_SIDE,
    MIN_SIDE,
    P_EDGE,
    P_LARGEST_RECTANGLE,
)

Draw = Callable[[], float]  # uniform on [0, 1)
RoomSize = tuple[str, float, float]  # our room, metres, metres


def choose_weighted(draw: Draw, weights: Sequence[float]) -> int:
    """Index drawn in proportion to the weights."""
    target = draw() * sum(weights)
    for index, weight in enumerate(weights):
        target -= weight
        if target < 0:
            return index
    return len(weights) - 1


class Rectangle(NamedTuple):
    """Axis-parallel rectangle of the floor, in metres."""

    x0: float
    z0: float
    x1: float
    z1: float

    @property
    def area(self) -> float:
        """Square metres."""
        return (self.x1 - self.x0) * (self.z1 - self.z0)


def sample_room_sizes(draw: Draw, cut_share: Callable[[int], float]) -> list[RoomSize]:
    """Draw a floor plan and return (room, width, depth) of its rooms, in metres.

    The floor is cut along its longer side in the ratio of the rooms' areas, again for each group of
    rooms. Corners that the generator cuts off shrink the whole floor.

    Args:
        draw: uniform numbers.
        cut_share: draws the share of a Beta(rooms / 2, 6), for the number of cuts.
    """
    sides, tree = _choose_spec(draw)
    num_rooms = _count_rooms(tree)
    if sides is None:
        low = max(MIN_SIDE, math.sqrt(num_rooms) * CELLS_PER_ROOM - math.ceil(CELLS_PER_ROOM / 2))
        high = math.sqrt(num_rooms) * CELLS_PER_ROOM + CELLS_PER_ROOM // 2 + 1
        width, depth = (int(low) + int(draw() * (int(high) - int(low))) for _ in range(2))
    else:
        width, depth = (low + int(draw() * (high - low + 1)) for low, high in sides)
    cut = 0
    for _ in range(round(cut_share(num_rooms) * 10)):
        x_cut = 1 + int(draw() * (max(2, min(width - 1, MAX_CUT // 2)) - 1))
        cut += x_cut * (1 + int(draw() * max(1, min(MAX_CUT // x_cut, depth - 1))))
    shrink = math.sqrt(max(0.4, 1 - cut / (width * depth)))
    scale = shrink * (CELL_SIZE[0] + draw() * (CELL_SIZE[1] - CELL_SIZE[0]))
    rooms: list[RoomSize] = []
    _split(tree, width * scale, depth * scale, rooms)
    return rooms


def _choose_spec(draw: Draw) -> tuple[Any, Any]:
    weights = [weight for weight, _, _ in HOUSE_SPECS]
    return HOUSE_SPECS[choose_weighted(draw, weights)][1:]


def _count_rooms(tree: Any) -> int:
    return sum(1 if isinstance(part, str) else _count_rooms(part) for _, part in tree)


def _split(tree: Any, width: float, depth: float, rooms: list[RoomSize]) -> None:
    total = sum(ratio for ratio, _ in tree)
    for ratio, part in tree:
        share = ratio / total
        part_width, part_depth = (
            (width * share, depth) if width >= depth else (width, depth * share)
        )
        if isinstance(part, str):
            rooms.append((part, part_width, part_depth))
        else:
            _split(part, part_width, part_depth, rooms)


class FreeFloor:
    """The free floor of one rectangular room, as its largest free rectangles.

    Attributes:
        rectangles: maximal free rectangles; they overlap.
    """

    def __init__(self, width: float, depth: float) -> None:
        self.width = width
        self.depth = depth
        self.rectangles = [Rectangle(0.0, 0.0, width, depth)]

    def cut_door(self, draw: Draw) -> None:
        """Keep the floor at a door free, at a random place of a random wall."""
        along_x = draw() < self.width / (self.width + self.depth)
        length, across = (self.width, self.depth) if along_x else (self.depth, self.width)
        start = draw() * max(0.0, length - DOOR_SIZE)
        near = 0.0 if draw() < 0.5 else max(0.0, across - DOOR_SIZE)
        wall, floor = (start, start + DOOR_SIZE), (near, near + DOOR_SIZE)
        x, z = (wall, floor) if along_x else (floor, wall)
        self.subtract(Rectangle(x[0], z[0], x[1], z[1]))

    def subtract(self, taken: Rectangle) -> None:
        """Take a rectangle away; what remains is split into maximal rectangles again."""
        kept, pieces = [], []
        for free in self.rectangles:
            if (
                taken.x0 >= free.x1
                or taken.x1 <= free.x0
                or taken.z0 >= free.z1
                or taken.z1 <= free.z0
            ):
                kept.append(free)
                continue
            if taken.x0 > free.x0:
                pieces.append(Rectangle(free.x0, free.z0, taken.x0, free.z1))
            if taken.x1 < free.x1:
                pieces.append(Rectangle(taken.x1, free.z0, free.x1, free.z1))
            if taken.z0 > free.z0:
                pieces.append(Rectangle(free.x0, free.z0, free.x1, taken.z0))
            if taken.z1 < free.z1:
                pieces.append(Rectangle(free.x0, taken.z1, free.x1, free.z1))
        for piece in sorted(set(pieces), key=lambda rectangle: -rectangle.area):
            if not any(
                other.x0 <= piece.x0
                and other.z0 <= piece.z0
                and other.x1 >= piece.x1
                and other.z1 >= piece.z1
                for other in kept
            ):
                kept.append(piece)
        self.rectangles = kept

    def sample_rectangle(self, draw: Draw, tried: set[Rectangle]) -> Rectangle | None:
        """The largest free rectangle (80 %), or one drawn by area; never one tried before."""
        options = [rectangle for rectangle in self.rectangles if rectangle not in tried]
        if not options:
            return None
        if draw() < P_LARGEST_RECTANGLE:
            return max(options, key=lambda rectangle: rectangle.area)
        options = [
            rectangle
            for rectangle in options
            if rectangle.x1 - rectangle.x0 >= MIN_RECTANGLE_SIDE
            and rectangle.z1 - rectangle.z0 >= MIN_RECTANGLE_SIDE
        ]
        if not options:
            return None
        return options[choose_weighted(draw, [rectangle.area for rectangle in options])]

    def sample_anchor(self, draw: Draw, rectangle: Rectangle) -> str:
        """Where to place in a rectangle: a string of the walls ("x-" "x+" "z-" "z+"), or "".

        Two walls are a corner, one is an edge (70 %), none is the middle.
        """
        x_walls = [
            name
            for name, touches in (("x-", rectangle.x0 <= 0), ("x+", rectangle.x1 >= self.width))
            if touches
        ]
        z_walls = [
            name
            for name, touches in (("z-", rectangle.z0 <= 0), ("z+", rectangle.z1 >= self.depth))
            if touches
        ]
        if x_walls and z_walls:
            return x_walls[int(draw() * len(x_walls))] + z_walls[int(draw() * len(z_walls))]
        walls = x_walls + z_walls
        if walls and draw() < P_EDGE:
            return walls[int(draw() * len(walls))]
        return ""

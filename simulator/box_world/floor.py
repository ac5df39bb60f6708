"""The floor of a home of boxes: rooms beside a corridor, walls, doors, furniture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sgm.layout.box import Box
from simulator.box_world.sizes import FurnitureSize, find_furniture_size

CORRIDOR = 1.6  # metres between the two rows of rooms
WALL = 0.1  # metres of thickness
WALL_HEIGHT = 2.5
DOOR = 0.9  # metres of width
STANDOFF = 0.75  # metres before furniture from where it is looked at
ROBOT_RADIUS = 0.25  # metres
_FREE_FRONT = 1.3  # metres before furniture where nothing else stands
_LEAST_FRONT = 0.7  # metres of width of that
_GAP = 0.05  # metres between pieces of furniture
_DOOR_DEPTH = 1.2  # metres behind a door where nothing stands
_TRIES = 200  # places for one piece of furniture
_ROUNDS = 12  # arrangements of a room before it gets larger
_GROWTH = 1.1  # how much longer its sides are then
_STANDS_FREE = frozenset(("table", "dining table", "coffee table", "kitchen island", "chair"))


@dataclass(frozen=True, slots=True)
class BoxRoom:
    """A room: a rectangle with a door to the corridor.

    Attributes:
        low, high: its corners, metres.
        door: x, y of the middle of its door.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    door: tuple[float, float]


@dataclass(frozen=True, slots=True)
class BoxFloor:
    """Where everything of a home stands.

    Attributes:
        rooms: (R,).
        furniture: boxes in the order of the home's furniture, (F,).
        shapes: of the furniture, one of `SHAPES`, (F,).
        walls: boxes.
        low, high: corners of the whole home.
    """

    rooms: tuple[BoxRoom, ...]
    furniture: tuple[Box, ...]
    shapes: tuple[str, ...]
    walls: tuple[Box, ...]
    low: tuple[float, float]
    high: tuple[float, float]

    def find_stand(self, furniture: int) -> tuple[float, float]:
        """Return where a robot stands to look at furniture: before the middle of its front."""
        box = self.furniture[furniture]
        x, y, _ = box.to_map(np.array([box.size[0] / 2 + STANDOFF, 0.0, 0.0]))
        return float(x), float(y)


_Point = tuple[float, float]
_Area = tuple[_Point, _Point]  # low and high x, y


class _Piece(NamedTuple):
    """Furniture in the axes of its room, and free space before it.

    Plain numbers: most pieces that are drawn do not fit, and numpy is slow with two.
    """

    area: _Area
    front: _Area
    yaw: float


def sample_floor(
    labels: Sequence[str], furniture_room: Sequence[int], num_rooms: int, rng: np.random.Generator
) -> BoxFloor:
    """Lay out a home, so that no furniture overlaps and a robot can stand before all of it.

    Rooms lie on both sides of a corridor. A room is as large as its furniture needs.

    Args:
        labels: of the furniture, (F,).
        furniture_room: index of the room of each, (F,).
        num_rooms: R.
        rng: decides on everything.
    """
    sizes = [find_furniture_size(label) for label in labels]
    rooms: list[BoxRoom] = []
    boxes: list[Box | None] = [None] * len(sizes)
    ends = [0.0, 0.0]  # of the rows of rooms above and below the corridor
    for room in range(num_rooms):
        in_room = [number for number, of in enumerate(furniture_room) if of == room]
        frees = [labels[number] in _STANDS_FREE for number in in_room]
        width, depth, door, pieces = _sample_room([sizes[n] for n in in_room], frees, rng)
        side = int(ends[1] < ends[0])
        start = ends[side]
        ends[side] += width + WALL
        sign = 1 if side == 0 else -1
        near = sign * (CORRIDOR / 2 + WALL)
        far = near + sign * depth
        low, high = (start, min(near, far)), (start + width, max(near, far))
        rooms.append(BoxRoom(low, high, (start + door, sign * (CORRIDOR + WALL) / 2)))
        for number, piece in zip(in_room, pieces, strict=True):
            size, middle = sizes[number], np.mean(piece.area, axis=0)
            boxes[number] = Box(
                (start + middle[0], near + sign * middle[1], size.bottom + size.height / 2),
                (size.depth, size.width, size.height),
                piece.yaw if side == 0 else -piece.yaw,
                size.interior,
            )
    end = max(ends)
    furniture = tuple(box for box in boxes if box is not None)
    low = (-WALL, min([-CORRIDOR / 2, *(room.low[1] for room in rooms)]) - WALL)
    high = (end, max([CORRIDOR / 2, *(room.high[1] for room in rooms)]) + WALL)
    shapes = tuple(size.shape for size in sizes)
    return BoxFloor(tuple(rooms), furniture, shapes, tuple(_list_walls(rooms, end)), low, high)


def _sample_room(
    sizes: Sequence[FurnitureSize], frees: Sequence[bool], rng: np.random.Generator
) -> tuple[float, float, float, list[_Piece]]:
    """Return width, depth, x of the door and furniture in the room's axes, y from the door on."""
    area = 5.0 + sum((size.depth + 0.6) * (size.width + 0.2) for size in sizes)
    width, depth = math.sqrt(1.25 * area), math.sqrt(area / 1.25)
    while True:
        for _ in range(_ROUNDS):
            door = float(rng.uniform(DOOR, width - DOOR))
            pieces = _arrange(sizes, frees, width, depth, door, rng)
            if pieces is not None and _is_reachable(pieces, width, depth, door):
                return width, depth, door, pieces
        width, depth = width * _GROWTH, depth * _GROWTH


def _arrange(
    sizes: Sequence[FurnitureSize],
    frees: Sequence[bool],
    width: float,
    depth: float,
    door: float,
    rng: np.random.Generator,
) -> list[_Piece] | None:
    """Place furniture, the largest first; None if something found no place."""
    behind_door = ((door - DOOR, 0.0), (door + DOOR, _DOOR_DEPTH))
    whole = ((0.0, 0.0), (width, depth))
    placed: dict[int, _Piece] = {}
    for number in sorted(range(len(sizes)), key=lambda n: -sizes[n].width * sizes[n].depth):
        for _ in range(_TRIES):
            piece = _draw_piece(sizes[number], frees[number], (width, depth), rng)
            if not (_is_within(piece.area, whole) and _is_within(piece.front, whole)):
                continue
            if not _overlaps(piece.area, behind_door) and not any(
                _overlaps(_widen(piece.area, _GAP), other.area)
                or _overlaps(piece.area, other.front)
                or _overlaps(piece.front, other.area)
                for other in placed.values()
            ):
                placed[number] = piece
                break
        else:
            return None
    return [placed[number] for number in range(len(sizes))]


def _draw_piece(
    size: FurnitureSize, is_free: bool, room: _Point, rng: np.random.Generator
) -> _Piece:
    """Draw a place along a wall, or anywhere; it may not fit."""
    side = int(rng.integers(4))
    yaw = (0.0, math.pi / 2, math.pi, -math.pi / 2)[side]  # faces right, up, left, down
    ahead, across, sign = side % 2, 1 - side % 2, 1 if side < 2 else -1
    extent = (size.depth, size.width) if ahead == 0 else (size.width, size.depth)
    x, y = rng.random(2).tolist()
    low = [x * (room[0] - extent[0]), y * (room[1] - extent[1])]
    if not is_free:  # its back to a wall, a hand's width of 2 cm away
        low[ahead] = 0.02 if sign > 0 else room[ahead] - extent[ahead] - 0.02
    high = [low[0] + extent[0], low[1] + extent[1]]
    edge = (low[ahead] + high[ahead]) / 2 + sign * size.depth / 2
    reach = edge + sign * _FREE_FRONT
    middle, half = (low[across] + high[across]) / 2, max(size.width, _LEAST_FRONT) / 2
    along, beside = (min(edge, reach), max(edge, reach)), (middle - half, middle + half)
    (x0, x1), (y0, y1) = (along, beside) if ahead == 0 else (beside, along)
    area, front = ((low[0], low[1]), (high[0], high[1])), ((x0, y0), (x1, y1))
    return _Piece(area=area, front=front, yaw=yaw)


def _widen(area: _Area, margin: float) -> _Area:
    (x0, y0), (x1, y1) = area
    return (x0 - margin, y0 - margin), (x1 + margin, y1 + margin)


def _is_within(area: _Area, whole: _Area) -> bool:
    (x0, y0), (x1, y1) = area
    (left, low), (right, high) = whole
    return x0 >= left and y0 >= low and x1 <= right and y1 <= high


def _overlaps(area: _Area, other: _Area) -> bool:
    (x0, y0), (x1, y1) = area
    (left, low), (right, high) = other
    return x0 < right and y0 < high and left < x1 and low < y1


def _is_reachable(pieces: Sequence[_Piece], width: float, depth: float, door: float) -> bool:
    """Tell whether a robot comes from the door to before every piece."""
    cell = 0.1
    columns, rows = math.ceil(width / cell), math.ceil(depth / cell)
    x, y = (np.arange(columns) + 0.5) * cell, (np.arange(rows) + 0.5) * cell
    margin = ROBOT_RADIUS + cell / 2
    is_free = ((y > margin) & (y < depth - margin))[:, None] & ((x > margin) & (x < width - margin))
    for piece in pieces:
        low, high = _widen(piece.area, margin)
        is_free &= ~(((y > low[1]) & (y < high[1]))[:, None] & ((x > low[0]) & (x < high[0])))
    is_free[y <= depth / 2] |= (np.abs(x - door) < cell) & (y[y <= depth / 2, None] <= 2 * margin)
    from scipy.ndimage import label  # only a generator needs it

    region, _ = label(is_free)
    start = region[0, min(int(door / cell), columns - 1)]
    for piece in pieces:
        ahead = np.array([math.cos(piece.yaw), math.sin(piece.yaw)])
        length = float(np.ptp(np.array(piece.area), axis=0) @ np.abs(ahead))
        stand = np.mean(piece.area, axis=0) + ahead * (length / 2 + STANDOFF)
        column, row = (stand / cell).astype(int)
        if region[min(row, rows - 1), min(column, columns - 1)] != start or not start:
            return False
    return True


def _list_walls(rooms: Sequence[BoxRoom], end: float) -> list[Box]:
    """Return the walls of rooms and corridor; doors are open."""
    walls = []

    def build(x0: float, y0: float, x1: float, y1: float) -> None:
        if x1 - x0 > 1e-3 and y1 - y0 > 1e-3:
            middle = ((x0 + x1) / 2, (y0 + y1) / 2, WALL_HEIGHT / 2)
            walls.append(Box(middle, (x1 - x0, y1 - y0, WALL_HEIGHT)))

    for x in (-WALL, end - WALL):  # both ends of the corridor
        build(x, -CORRIDOR / 2 - WALL, x + WALL, CORRIDOR / 2 + WALL)
    filled = {1: 0.0, -1: 0.0}  # how far the corridor has rooms on each side
    for room in rooms:
        (x0, y0), (x1, y1) = room.low, room.high
        sign = 1 if y0 > 0 else -1
        filled[sign] = max(filled[sign], x1)
        near = (y0 - WALL, y0) if sign > 0 else (y1, y1 + WALL)
        far = (y1, y1 + WALL) if sign > 0 else (y0 - WALL, y0)
        build(x0 - WALL, y0 - WALL, x0, y1 + WALL)
        build(x1, y0 - WALL, x1 + WALL, y1 + WALL)
        build(x0, far[0], x1, far[1])
        build(x0, near[0], room.door[0] - DOOR / 2, near[1])
        build(room.door[0] + DOOR / 2, near[0], x1, near[1])
    for sign, reach in filled.items():  # where the corridor has no room beside it
        y0 = CORRIDOR / 2 if sign > 0 else -CORRIDOR / 2 - WALL
        build(reach, y0, end, y0 + WALL)
    return walls

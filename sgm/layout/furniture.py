"""A room and a piece of furniture, for memories, logs and traces."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sgm.checks import is_finite, is_number
from sgm.layout.box import Box
from sgm.layout.turns import turn_flat
from sgm.messages import shorten

_FAR = 1e9  # metres: no map has its origin farther away


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

    What it may have besides a label, a room and a description is the last fields, None where it is
    unknown: they are read and written here (`from_row`, `to_row`), for memory files and logs.

    Attributes:
        label: what it is, such as "fridge".
        room: id of its room.
        description: for people, such as "white fridge".
        name: tells it from all other furniture of the home, such as "shelf 2"; empty where its id
            does.
        position: where one stands to look at it, in metres; None if it is unknown.
        box: its extents in the map; None if it is unknown.
        open_cost: of opening it to look into it, in the unit of distances; None if there is nothing
            to open.
    """

    label: str
    room: int
    description: str
    name: str = ""
    position: tuple[float, float] | None = None
    box: Box | None = None
    open_cost: float | None = None

    @property
    def location(self) -> tuple[float, float, float] | None:
        """Where it is, x, y, z in the map, metres; None if it is unknown.

        The middle of its box, or, without one, on the floor where one stands to look at it.
        """
        if self.box is not None:
            return self.box.center
        return None if self.position is None else (*self.position, 0.0)

    @property
    def must_open(self) -> bool:
        """Whether it must be opened to look into it."""
        return self.open_cost is not None or (self.box is not None and self.box.has_door)

    def transform(self, angle: float, shift: tuple[float, float]) -> Furniture:
        """Return it turned around the origin of the map, and moved then; see `Layout.transform`."""
        position, box = self.position, self.box
        if position is not None:
            position = turn_flat(*position, angle, shift)
        if box is not None:
            center = (*turn_flat(*box.center[:2], angle, shift), box.center[2])
            box = replace(box, center=center, yaw=box.yaw + angle)
        return replace(self, position=position, box=box)

    def to_row(self) -> list[Any]:
        """Return JSON values, without the last ones that are unknown; names are in no row."""
        values: list[Any] = [self.label, self.room, self.description]
        values.append(None if self.position is None else list(self.position))
        values.append(None if self.box is None else self.box.to_json())
        values.append(self.open_cost)
        while values[-1] is None:
            values.pop()
        return values

    @classmethod
    def from_row(
        cls,
        label: str,
        room: int,
        description: str,
        position: Any = None,
        box: Any = None,
        open_cost: Any = None,
    ) -> Furniture:
        """Read JSON values; raises ValueError for a position, box or cost that is none."""
        return cls(
            label,
            room,
            description,
            position=read_position(position),
            box=None if box is None else Box.from_json(box),
            open_cost=read_open_cost(open_cost),
        )


def read_position(position: Any = None) -> tuple[float, float] | None:
    """Return a position as two floats; None stays None, other values raise ValueError.

    Of three numbers, as answers have them, the last is a height, on which one does not stand.
    """
    if position is None:
        return None
    try:
        x, y, *height = (
            float(value) if is_number(value) and -_FAR <= value <= _FAR else math.nan
            for value in position
        )
    except (TypeError, ValueError):
        x, y, height = math.nan, math.nan, []
    if math.isnan(sum((x, y, *height))) or len(height) > 1:
        raise ValueError(
            f"position must be two numbers, got {shorten(position)}. Give metres, such as (1.5, 4)."
        )
    return x, y


def read_open_cost(cost: Any = None) -> float | None:
    """Return a finite cost of 0 or more; None stays None, other values raise ValueError."""
    if cost is None:
        return None
    if not is_finite(cost) or not cost >= 0:
        raise ValueError(
            f"open_cost must be a finite number, 0 or more, got {shorten(cost)}. Give what opening "
            "it costs in the unit of the distances, or leave it out where there is no door."
        )
    return float(cost)


_DISTANCES = (0.7, 0.9, 0.5, 1.2, 1.6)  # metres from the side to the robot's middle, best first
_CLEARANCE = 0.3  # metres around the robot's middle that must be free
_TALLEST = 1.8  # metres: what hangs higher is in no robot's way
_STEP = 0.1  # metres above the floor: what is lower is walked over
_FLOOR = "floor"
_PATCH = 1.2  # metres: a floor that is no longer is where something lies, as eyes draw it, no room
_THING = 0.2  # metres: side of what lies at furniture whose extents are unknown


def compute_positions(
    furniture: Mapping[int, Furniture],
) -> dict[int, tuple[float, float] | None]:
    """Return where one stands to look at each furniture node, by id, as given or found.

    Where none was given, a point before the front of its box, or, if that is not free, at another
    side: outside all boxes, and on the floor of its room where that has a box. A floor is looked at
    from its middle, or from the free point that is nearest to it; a patch of it from beside.

    Returns:
        None for furniture with neither a position nor a box, or with no free side.
    """
    boxes = _get_boxes(furniture)
    return {number: _find_position(furniture, boxes, number) for number in furniture}


def compute_position(
    furniture: Mapping[int, Furniture],
    number: int,
    point: tuple[float, float, float] | None = None,
) -> tuple[float, float] | None:
    """Return where one stands to look at one furniture node, as `compute_positions` does for all.

    Args:
        furniture: by id.
        number: id of the one.
        point: x, y, z in the map, metres: what is looked at there, so that one stands before that.
    """
    return _find_position(furniture, _get_boxes(furniture), number, point)


def _get_boxes(furniture: Mapping[int, Furniture]) -> dict[int, Box]:
    return {number: piece.box for number, piece in furniture.items() if piece.box is not None}


def _find_position(
    furniture: Mapping[int, Furniture],
    boxes: Mapping[int, Box],
    number: int,
    point: tuple[float, float, float] | None = None,
) -> tuple[float, float] | None:
    piece, extents = furniture[number], furniture[number].box
    if extents is None and point is not None:  # unknown: around what is looked at
        extents = Box(point, (_THING, _THING, _THING))
    if piece.position is not None or extents is None:
        return piece.position
    in_room = [other for other in boxes if furniture[other].room == piece.room]
    drawn = [boxes[other] for other in in_room if furniture[other].label == _FLOOR]
    floors = [box for box in drawn if max(box.size[:2]) > _PATCH]  # one stands on them
    # Of a floor without a box: the lowest side of the furniture of its room.
    lowest = min((boxes[other].bottom for other in in_room), default=0.0)
    ground = next((box.top for box in (*floors, *drawn)), lowest)
    in_the_way = [
        box
        for other, box in boxes.items()
        if furniture[other].label != _FLOOR
        and box.top > ground + _STEP
        and box.bottom < ground + _TALLEST
        and math.dist(box.center[:2], extents.center[:2]) < _get_reach(box) + _get_reach(extents)
    ]
    is_floor = piece.label == _FLOOR and piece.box in floors
    points = _list_points(extents, is_floor=is_floor, point=point)
    is_free = np.ones(len(points), dtype=bool)
    flat = np.column_stack([points, np.zeros(len(points))])
    for box in in_the_way:
        flat[:, 2] = box.center[2]
        is_free &= ~box.contains(flat, _CLEARANCE)
    if floors:
        on_floor = np.zeros(len(points), dtype=bool)
        for box in floors:
            flat[:, 2] = box.center[2]
            on_floor |= box.contains(flat)
        is_free &= on_floor
    if not is_free.any():
        return None
    x, y = points[int(is_free.argmax())].tolist()
    return x, y


def compute_pose(
    furniture: Mapping[int, Furniture],
    number: int,
    point: tuple[float, float, float] | None = None,
) -> tuple[float, float, float] | None:
    """Return where one stands to look at a furniture node, x, y, and the yaw with which one does.

    Where no side of it is free, that is its middle; where it is not known which way to look, the
    yaw is 0.

    Args:
        furniture: by id.
        number: id of the one.
        point: x, y, z in the map, metres: what is looked at there; None for its middle.

    Returns:
        Metres and radians; None where it is not known where it stands.
    """
    target = furniture[number].location if point is None else point
    if target is None:
        return None
    x, y = compute_position(furniture, number, point) or target[:2]
    return x, y, math.atan2(target[1] - y, target[0] - x)


def _get_reach(box: Box) -> float:
    """Return how far from its middle a box is, or one stands to look at it, at most."""
    return math.hypot(*box.size[:2]) / 2 + max(_DISTANCES) + _CLEARANCE


def _list_points(
    box: Box, *, is_floor: bool, point: tuple[float, float, float] | None = None
) -> np.ndarray:
    """Return the points from which one may look at a box, or there, the best first, (n, 2)."""
    half = np.array(box.size) / 2
    local_point = np.zeros(2) if point is None else box.to_own(np.array(point))[:2]
    across, along = np.clip(local_point / half[:2], -1, 1).tolist()
    if is_floor:
        steps = [np.linspace(-side, side, 15)[1:-1] for side in half[:2]]
        candidates = np.array([(x, y) for x in steps[0] for y in steps[1]])
        away_from_it = np.hypot(*(candidates - local_point).T)
        if point is not None:  # before it, not on it
            away_from_it = np.abs(away_from_it - _DISTANCES[0])
        candidates = candidates[np.argsort(away_from_it, kind="stable")]
    else:
        candidates = np.array(
            [
                np.where(side, side * (half[:2] + away), beside * half[:2])
                for side in np.array([(1, 0), (0, 1), (0, -1), (-1, 0)])  # the front first
                for beside in (along if side[0] else across, 0.0, 0.5, -0.5)
                for away in _DISTANCES
            ]
        )
    return box.to_map(np.column_stack([candidates, np.zeros(len(candidates))]))[:, :2]

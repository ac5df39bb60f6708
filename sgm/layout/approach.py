"""Where one stands to look at furniture: in front of it, outside all boxes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from sgm.layout.box import Box
from sgm.layout.furniture import Furniture

_DISTANCES = (0.7, 0.9, 0.5, 1.2, 1.6)  # metres from the side to the robot's middle, best first
_CLEARANCE = 0.3  # metres around the robot's middle that must be free
_TALLEST = 1.8  # metres: what hangs higher is in no robot's way
_STEP = 0.1  # metres above the floor: what is lower is walked over
_FLOOR = "floor"


def compute_positions(
    furniture: Mapping[int, Furniture],
) -> dict[int, tuple[float, float] | None]:
    """Return where one stands to look at each furniture node, by id, as given or found.

    Where none was given, a point before the front of its box, or, if that is not free, at another
    side: outside all boxes, and on the floor of its room where that has a box. A floor is looked at
    from its middle, or from the free point that is nearest to it.

    Returns:
        None for furniture with neither a position nor a box, or with no free side.
    """
    boxes = {number: row.box for number, row in furniture.items() if row.box is not None}
    floors = {number: boxes[number] for number in boxes if furniture[number].label == _FLOOR}
    found: dict[int, tuple[float, float] | None] = {}
    for number, row in furniture.items():
        found[number] = row.position
        if row.position is not None or row.box is None:
            continue
        of_room = [floors[other] for other in floors if furniture[other].room == row.room]
        # Of a floor without a box: the lowest side of the furniture of its room.
        bottoms = [box.bottom for other, box in boxes.items() if furniture[other].room == row.room]
        ground = of_room[0].top if of_room else min(bottoms)
        in_the_way = [
            box
            for other, box in boxes.items()
            if other not in floors
            and box.top > ground + _STEP
            and box.bottom < ground + _TALLEST
            and _are_near(box, row.box)
        ]
        points = _list_points(row.box, is_floor=number in floors)
        is_free = np.ones(len(points), dtype=bool)
        flat = np.column_stack([points, np.zeros(len(points))])
        for box in in_the_way:
            flat[:, 2] = box.center[2]
            is_free &= ~box.contains(flat, _CLEARANCE)
        if of_room:
            on_floor = np.zeros(len(points), dtype=bool)
            for box in of_room:
                flat[:, 2] = box.center[2]
                on_floor |= box.contains(flat)
            is_free &= on_floor
        if is_free.any():
            x, y = points[int(is_free.argmax())].tolist()
            found[number] = (x, y)
    return found


def _are_near(box: Box, other: Box) -> bool:
    """Tell whether one of two boxes may be in the way of who looks at the other."""
    return math.dist(box.center[:2], other.center[:2]) < _get_reach(box) + _get_reach(other)


def _get_reach(box: Box) -> float:
    """Return how far from its middle a box is, or one stands to look at it, at most."""
    return math.hypot(*box.size[:2]) / 2 + max(_DISTANCES) + _CLEARANCE


def _list_points(box: Box, *, is_floor: bool) -> np.ndarray:
    """Return the points from which one may look at a box, the best first, (n, 2)."""
    half = np.array(box.size) / 2
    if is_floor:
        steps = [np.linspace(-side, side, 15)[1:-1] for side in half[:2]]
        own = np.array([(x, y) for x in steps[0] for y in steps[1]])
        own = own[np.argsort(np.hypot(*own.T), kind="stable")]
    else:
        own = np.array(
            [
                np.where(side, side * (half[:2] + away), beside * half[:2])
                for side in np.array([(1, 0), (0, 1), (0, -1), (-1, 0)])  # the front first
                for beside in (0.0, 0.5, -0.5)
                for away in _DISTANCES
            ]
        )
    return box.to_map(np.column_stack([own, np.zeros(len(own))]))[:, :2]

"""Ways from place to place on the map: through the doors, where they are known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from nep.view.plan_shapes import PlanShapes
from sgm.layout.outline import compute_outline_distance

_FARTHEST = 1.0  # metres from a door to the rooms that it joins


def list_ways(shapes: PlanShapes, stops: Sequence[int]) -> list[list[list[float]]]:
    """Return the doors on the way from each of some places to the next, (x, y) of each.

    Where doors join the rooms of two places, these are those of the shortest way; else there are
    none, and the way is drawn straight.

    Args:
        shapes: where everything stands.
        stops: furniture, by number in the plan.
    """
    joined = _join_rooms(shapes)
    return [np.round(_go(shapes, joined, start, end), 3).tolist() for start, end in pairwise(stops)]


def _join_rooms(shapes: PlanShapes) -> list[tuple[int, ...]]:
    """Return the rooms that each door leads to: up to two, the nearest ones."""
    joined = []
    for door in shapes.doors:
        away = np.array(
            [
                compute_outline_distance(tuple(map(tuple, corners.tolist())), door[None])[0]
                for corners in shapes.room_outlines
            ]
        )
        near = np.argsort(away, kind="stable")[:2]
        joined.append(tuple(int(room) for room in near if away[room] <= _FARTHEST))
    return joined


def _go(
    shapes: PlanShapes, joined: Sequence[tuple[int, ...]], start: int, end: int
) -> list[np.ndarray]:
    """Return the doors on the shortest way between two furniture nodes, by Dijkstra's algorithm."""
    rooms = shapes.furniture_room
    if rooms[start] == rooms[end]:
        return []
    doors = shapes.doors
    cost = np.array(
        [
            np.linalg.norm(door - shapes.middles[start]) if rooms[start] in own else np.inf
            for door, own in zip(doors, joined, strict=True)
        ]
    )
    before = np.full(len(doors), -1)
    is_open = np.ones(len(doors), dtype=bool)
    while np.isfinite(np.where(is_open, cost, np.inf)).any():
        here = int(np.where(is_open, cost, np.inf).argmin())
        is_open[here] = False
        for other in np.flatnonzero(is_open).tolist():
            way = cost[here] + np.linalg.norm(doors[other] - doors[here])
            if set(joined[here]) & set(joined[other]) and way < cost[other]:
                cost[other], before[other] = way, here
    last = [
        cost[door] + np.linalg.norm(doors[door] - shapes.middles[end])
        if rooms[end] in joined[door] else np.inf
        for door in range(len(doors))
    ]  # fmt: skip
    if not np.isfinite(last).any():
        return []
    way, at = [], int(np.argmin(last))
    while at >= 0:
        way.append(doors[at])
        at = int(before[at])
    return way[::-1]

"""Ways from place to place on the map: through the doors, where they are known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from nep.view.plan_shapes import PlanShapes
from sgm.layout.outline import compute_outline_distance

_FARTHEST = 1.0  # metres from a door to the rooms that it joins


def list_ways(shapes: PlanShapes, stops: Sequence[int]) -> list[list[list[float]]]:
    """Return the doors on the way from each of some places to the next, (x, y) of each.

    Where doors join the rooms of two places, these are those of the shortest way; else there are
    none, and the way is drawn straight.
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


def _go(shapes: PlanShapes, joined: Sequence[tuple[int, ...]], start: int, end: int) -> np.ndarray:
    """Return the doors on the shortest way between two furniture nodes, (n, 2)."""
    rooms = shapes.furniture_room
    own = [{rooms[start]}, {rooms[end]}, *map(set, joined)]  # of the two ends, and of each door
    shares = np.array([[bool(one & other) for other in own] for one in own])
    if shares[0, 1]:
        return np.zeros((0, 2))
    points = np.concatenate([shapes.middles[[start, end]], shapes.doors])
    length = np.linalg.norm(points[:, None] - points, axis=-1)
    graph = csgraph_from_dense(np.where(shares, length, np.inf), null_value=np.inf)
    _, before = dijkstra(graph, indices=0, return_predecessors=True)
    way, at = [], before[1]
    while at > 0:  # negative: there is no way
        way.append(at)
        at = before[at]
    return points[way[::-1]]

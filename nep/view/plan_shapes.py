"""What stands where on the map, to scale where that is known; looks at it and ways through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from sgm.layout.furniture import Furniture
from sgm.layout.outline import compute_edge_distance, compute_outline_distance, contains_points
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.drawing.floor_plan import FloorPlan
from simulator.drawing.home import get_room_colour

FLOOR = "floor"  # label of furniture that is the ground of its room
_PAD = 0.3  # metres around furniture, where the room has no floor of its own
_SIDES = (0.4, 1.0)  # metres: least and most of a box around a point
_RINGS = 12  # around a point, in which a box looks for a free spot
_IN_ROWS = (0.05, 0.2, 0.9, 0.7)  # of the unit square of furniture that is laid out: its box
_DIGITS = 3
_FARTHEST = 1.0  # metres from a door to the rooms that it joins


@dataclass(frozen=True)
class PlanShapes:
    """A home from above.

    Attributes:
        rooms: names, (R,).
        room_outlines: corners of each, (k, 2).
        has_floor: whether the outline of a room is known, and not a box around its furniture, (R,).
        furniture_ids, furniture: ids and names, (F,).
        furniture_room: room index of each furniture node, (F,).
        outlines: corners of each furniture node, (k, 2).
        is_to_scale: whether that is its footprint, and not a box around a point, (F,).
        insides: where its things are drawn: x, y of the middle, width, height, yaw, (F, 5).
        stands: where one stands to look at it, nan where it is unknown, (F, 2).
        doors: middles of the doors between rooms, (D, 2).
        has_positions: whether furniture stands where it is, and not in rows by room.
    """

    rooms: tuple[str, ...]
    room_outlines: tuple[np.ndarray, ...]
    has_floor: tuple[bool, ...]
    furniture_ids: tuple[int, ...]
    furniture: tuple[str, ...]
    furniture_room: np.ndarray
    outlines: tuple[np.ndarray, ...]
    is_to_scale: tuple[bool, ...]
    insides: np.ndarray
    stands: np.ndarray
    doors: np.ndarray
    has_positions: bool

    @classmethod
    def of_memory(cls, memory: SceneGraphMemory) -> PlanShapes:
        """Place what a memory knows: in rows by room if nothing has a box or a position.

        Furniture with a box has its footprint, furniture with a position a box around it that
        covers no other, and the rest a free spot in its room. A piece of furniture with the label
        `FLOOR` and a box is the outline of its room.
        """
        layout = memory.layout
        nodes = layout.furniture
        if all(node.box is None and node.position is None for node in nodes.values()):
            return cls.of_plan(FloorPlan.of_memory(memory))
        index = {room: number for number, room in enumerate(layout.rooms)}
        rooms = np.array([index[node.room] for node in nodes.values()], dtype=np.int64)
        rows = list(nodes.values())
        stands = layout.compute_positions().values()
        outlines, insides = _place(rows, rooms)
        floors = {int(rooms[n]): outlines[n] for n, piece in enumerate(rows) if _is_floor(piece)}
        room_outlines = []
        east = max((float(corners[:, 0].max()) for corners in outlines), default=0.0)
        for room in range(len(index)):
            parts = [outlines[n] for n in np.flatnonzero(rooms == room)]
            if room in floors:
                room_outlines.append(floors[room])
            elif parts:
                corners = np.concatenate(parts)
                low, high = corners.min(axis=0) - _PAD, corners.max(axis=0) + _PAD
                room_outlines.append(_make_box((low + high) / 2, high - low))
            else:  # beside the home
                east += 2.0
                room_outlines.append(_make_box(np.array([east - 0.5, 0.5]), np.ones(2)))
        return cls(
            layout.room_labels,
            tuple(room_outlines),
            tuple(n in floors for n in index.values()),
            tuple(nodes),
            tuple(piece.description for piece in rows),
            rooms,
            tuple(outlines),
            tuple(piece.box is not None for piece in rows),
            insides,
            np.array([(np.nan, np.nan) if stand is None else stand for stand in stands]).reshape(
                -1, 2
            ),
            np.zeros((0, 2)),
            True,
        )

    @classmethod
    def of_plan(cls, plan: FloorPlan) -> PlanShapes:
        """Take a floor plan over."""
        boxes = plan.room_box
        rooms = [_make_box(box[:2] + box[2:] / 2, box[2:]) for box in boxes]
        outlines, insides = [], np.zeros((len(plan.furniture), 5))
        left, bottom, width, height = np.array(_IN_ROWS) * plan.size
        for node, (x, y) in enumerate(plan.corner):
            known = None if plan.footprints is None else plan.footprints[node]
            if known is not None and np.isfinite(known).all():
                outlines.append(known)
                low, high = known.min(axis=0), known.max(axis=0)
            else:
                low = np.array([x + left, y + bottom])
                high = low + np.array([width, height])
                outlines.append(_make_box((low + high) / 2, high - low))
            insides[node] = [*((low + high) / 2), *(high - low), 0]
        nowhere = np.full((len(plan.furniture), 2), np.nan)
        return cls(
            plan.rooms,
            tuple(rooms),
            (plan.has_positions,) * len(rooms),
            plan.furniture_ids,
            plan.furniture,
            plan.furniture_room,
            tuple(outlines),
            (plan.footprints is not None,) * len(outlines),
            insides,
            nowhere if plan.stands is None else plan.stands,
            np.zeros((0, 2)) if plan.doors is None else plan.doors,
            plan.has_positions,
        )

    @property
    def middles(self) -> np.ndarray:
        """Where each furniture node is, (F, 2)."""
        return self.insides[:, :2]

    def to_json(self) -> dict[str, Any]:
        """Return what the page draws."""
        return {
            "hasPositions": self.has_positions,
            "rooms": [
                {"name": name, "poly": _round(corners), "known": known, "colour": colour}
                for name, corners, known, colour in zip(
                    self.rooms,
                    self.room_outlines,
                    self.has_floor,
                    map(get_room_colour, self.rooms),
                    strict=True,
                )
            ],
            "furniture": [
                {
                    "id": number,
                    "name": name,
                    "room": room,
                    "poly": _round(corners),
                    "toScale": known,
                    "inside": inside,
                }
                for number, name, room, corners, known, inside in zip(
                    self.furniture_ids,
                    self.furniture,
                    self.furniture_room.tolist(),
                    self.outlines,
                    self.is_to_scale,
                    _round(self.insides),
                    strict=True,
                )
            ],
            "doors": _round(self.doors),
        }


def _place(rows: Sequence[Furniture], rooms: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the outline of each furniture node, and the middle, size and yaw of its inside."""
    side = _choose_side(rows)
    outlines: list[np.ndarray] = [np.zeros((0, 2))] * len(rows)
    insides = np.zeros((len(rows), 5))
    taken: list[np.ndarray] = []  # left, bottom, right, top
    for node, piece in enumerate(rows):
        if piece.box is None or _is_floor(piece):
            continue
        outlines[node] = piece.box.corners
        if piece.box.outline is None:
            insides[node] = [*piece.box.center[:2], *piece.box.size[:2], piece.box.yaw]
        else:
            insides[node] = _find_inside(piece.box.corners)
        taken.append(np.concatenate([outlines[node].min(axis=0), outlines[node].max(axis=0)]))
    known = [
        node for node, piece in enumerate(rows) if piece.box is None and piece.position is not None
    ]
    unknown = [n for n, piece in enumerate(rows) if piece.box is None and piece.position is None]
    floors = [node for node, piece in enumerate(rows) if _is_floor(piece)]
    for node in (*known, *floors, *unknown):
        piece = rows[node]
        if piece.box is not None:  # a floor: its things lie where it is free
            outlines[node] = piece.box.corners
            wish = _find_inside(piece.box.corners)[:2]
        elif piece.position is not None:
            wish = np.array(piece.position)
        else:
            beside = [outlines[n] for n in np.flatnonzero(rooms == rooms[node]) if len(outlines[n])]
            others = beside or [corners for corners in outlines if len(corners)]
            corners = np.concatenate(others)
            wish = (corners.min(axis=0) + corners.max(axis=0)) / 2
            wish = wish if beside else np.array([corners[:, 0].max() + 2 * side, wish[1]])
        middle = _find_free(wish, side, taken)
        taken.append(np.concatenate([middle - side / 2, middle + side / 2]))
        insides[node] = [*middle, side, side, 0]
        if piece.box is None:
            outlines[node] = _make_box(middle, np.array([side, side]))
    return outlines, insides


def _choose_side(rows: Sequence[Furniture]) -> float:
    """Return the side of a box around a point: few cover each other, and none is a speck."""
    points = np.array(
        [piece.position for piece in rows if piece.box is None and piece.position is not None]
    )
    if len(points) < 2:
        return 0.7
    apart = np.abs(points[:, None] - points[None]).max(axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(np.clip(0.9 * np.quantile(apart.min(axis=1), 0.25), *_SIDES))


def _find_free(wish: np.ndarray, side: float, taken: Sequence[np.ndarray]) -> np.ndarray:
    """Return the middle (2,) of a free square near a point; the point itself if all is taken."""
    if not taken:
        return wish
    boxes = np.array(taken)
    for ring in range(_RINGS):
        turns = np.linspace(0, 2 * np.pi, max(8 * ring, 1), endpoint=False)
        ways = np.column_stack([np.cos(turns), np.sin(turns)]) * ring * side / 2
        for spot in wish + ways:
            low, high = spot - 0.52 * side, spot + 0.52 * side
            is_over = (boxes[:, :2] < high).all(axis=1) & (boxes[:, 2:] > low).all(axis=1)
            if not is_over.any():
                return np.asarray(spot)
    return wish


def _find_inside(corners: np.ndarray) -> np.ndarray:
    """Return a square in a polygon: x, y, width, height, yaw, where its sides are farthest."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    axes = [np.linspace(low[axis], high[axis], 25)[1:-1] for axis in (0, 1)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    outline = tuple(map(tuple, corners.tolist()))
    away = np.where(contains_points(outline, points), compute_edge_distance(outline, points), -1.0)
    best = int(away.argmax())
    side = max(float(away[best]), 0.05) * np.sqrt(2)
    return np.array([*points[best], side, side, 0.0])


def _make_box(middle: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the corners (4, 2) of a rectangle by its middle and size, (2,) each."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size / 2
    return np.asarray(corners + middle)


def _is_floor(piece: Furniture) -> bool:
    return piece.label == FLOOR and piece.box is not None


def _round(values: np.ndarray) -> list[Any]:
    rounded: list[Any] = np.round(values, _DIGITS).tolist()
    return rounded


def make_cone(shapes: PlanShapes, node: int, viewpoint: Viewpoint | None) -> np.ndarray | None:
    """Return the camera and both ends of what it saw, (3, 2); None where nothing is known.

    A look that says from where it was has the cone of its camera, as far as the furniture reaches.
    Else the cone is that from where one stands to look at furniture with a footprint, and the angle
    that the furniture fills.
    """
    corners = shapes.outlines[node] if shapes.is_to_scale[node] else None
    if viewpoint is not None:
        camera = np.array([viewpoint.x, viewpoint.y])
        away = np.inf if corners is None else np.linalg.norm(corners - camera, axis=1).max()
        return viewpoint.compute_corners(float(away))
    stand = shapes.stands[node]
    if corners is None or not np.isfinite(stand).all():
        return None
    return np.array([stand, *find_outer_corners(stand, corners)])


def find_outer_corners(stand: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the two corners (2, 2) between which furniture (k, 2) is seen from a position (2,)."""
    ahead = corners.mean(axis=0) - stand
    offset = corners - stand
    side = ahead[0] * offset[:, 1] - ahead[1] * offset[:, 0]
    angle = np.arctan2(side, offset @ ahead)
    return np.asarray(corners[[angle.argmin(), angle.argmax()]])


def list_ways(shapes: PlanShapes, stops: Sequence[int]) -> list[list[list[float]]]:
    """Return the doors on the way from each of some places to the next, (x, y) of each.

    Where doors join the rooms of two places, these are those of the shortest way; else there are
    none, and the way is drawn straight.
    """
    joined = _join_rooms(shapes)
    return [_round(_go(shapes, joined, start, end)) for start, end in pairwise(stops)]


def _join_rooms(shapes: PlanShapes) -> list[set[int]]:
    """Return the rooms that each door leads to: up to two, the nearest ones."""
    outlines = [tuple(map(tuple, corners.tolist())) for corners in shapes.room_outlines]
    distances = [compute_outline_distance(outline, shapes.doors) for outline in outlines]
    away = np.array(distances).reshape(len(outlines), len(shapes.doors))
    near = np.argsort(away, axis=0, kind="stable")[:2]
    return [set(near[away[near[:, door], door] <= _FARTHEST, door]) for door in range(len(near.T))]


def _go(shapes: PlanShapes, joined: Sequence[set[int]], start: int, end: int) -> np.ndarray:
    """Return the doors on the shortest way between two furniture nodes, (n, 2)."""
    rooms = shapes.furniture_room
    rooms_of = [{rooms[start]}, {rooms[end]}, *joined]  # of the two ends, and of each door
    shares = np.array([[bool(first & second) for second in rooms_of] for first in rooms_of])
    if shares[0, 1]:
        return np.zeros((0, 2))
    points = np.concatenate([shapes.middles[[start, end]], shapes.doors])
    length = np.linalg.norm(points[:, None] - points, axis=-1)
    graph = csgraph_from_dense(np.where(shares, length, np.inf), null_value=np.inf)
    _, before = dijkstra(graph, indices=0, return_predecessors=True)
    way, door = [], before[1]
    while door > 0:  # negative: there is no way
        way.append(door)
        door = before[door]
    return points[way[::-1]]

"""Where rooms, furniture and objects stand in a picture of a home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.schema import IS_INSIDE, PlaceCode
from simulator.world.homes import Homes

COLUMNS = 4  # furniture nodes side by side in a room that is laid out
GAP = 0.35  # between rooms
TITLE = 0.2  # more of it above a room, for its name
# Of the unit square that a furniture node has: its box, and the rows of dots above it and in it.
BOX = (0.06, 0.2, 0.88, 0.38)
ROWS = np.array([(0.64, 0.76, 0.88), (0.51, 0.39, 0.27)])
DOTS_PER_ROW = 7


@dataclass(frozen=True)
class FloorPlan:
    """A home from above: boxes of R rooms and unit squares, or smaller ones, of F furniture nodes.

    Attributes:
        rooms: names, (R,).
        furniture: names, (F,).
        furniture_ids: what the memory calls them, (F,).
        furniture_room: room index of each furniture node, (F,).
        room_box: left, bottom, width, height of each room, (R, 4).
        corner: lower left corner of the square of each furniture node, (F, 2).
        size: side of the squares.
        has_positions: whether furniture stands where it is in metres, and not in rows by room.
        footprints: corners of the furniture with boxes, nan for others, (F, K, 2), the last one
            again where there are less than those of the polygon that has most; None without
            boxes.
        stands: where one stands to look at the furniture, nan where it is unknown, (F, 2); None
            without boxes.
        doors: middles of the doors between rooms, (D, 2); None where none are known.
    """

    rooms: tuple[str, ...]
    furniture: tuple[str, ...]
    furniture_ids: tuple[int, ...]
    furniture_room: np.ndarray
    room_box: np.ndarray
    corner: np.ndarray
    size: float = 1.0
    has_positions: bool = False
    footprints: np.ndarray | None = None
    stands: np.ndarray | None = None
    doors: np.ndarray | None = None

    @classmethod
    def make(
        cls,
        rooms: Sequence[str],
        furniture: Sequence[str],
        furniture_room: np.ndarray,
        furniture_ids: Sequence[int] | None = None,
        positions: np.ndarray | None = None,
        footprints: np.ndarray | None = None,
        stands: np.ndarray | None = None,
    ) -> FloorPlan:
        """Place everything.

        Args:
            rooms: names, (R,).
            furniture: names, (F,).
            furniture_room: room index of each furniture node, (F,).
            furniture_ids: None for 0 to F - 1.
            positions: of the furniture in metres, (F, 2); None to lay it out by room, rooms side
                by side.
            footprints: as in the class; rooms are then large enough for them.
            stands: as in the class.
        """
        furniture_room = np.asarray(furniture_room, dtype=np.int64)
        ids = range(len(furniture)) if furniture_ids is None else furniture_ids
        if positions is None:
            boxes, corner, size = *_lay_out(len(rooms), furniture_room), 1.0
        else:
            points = np.asarray(positions, float)
            boxes, corner, size = _place(len(rooms), furniture_room, points, footprints)
        return cls(
            tuple(rooms),
            tuple(furniture),
            tuple(ids),
            furniture_room,
            boxes,
            corner,
            size,
            positions is not None,
            footprints,
            stands,
        )

    @classmethod
    def of_memory(cls, memory: SceneGraphMemory) -> FloorPlan:
        """Place the rooms and furniture of a memory, to scale if all has a box or a position."""
        layout = memory.layout
        index = {room: number for number, room in enumerate(layout.rooms)}
        nodes = list(layout.furniture.values())
        places = [node.position if node.box is None else node.box.center[:2] for node in nodes]
        has_positions = bool(nodes) and None not in places
        footprints = stands = None
        if has_positions and any(node.box for node in nodes):
            most = max(4 if node.box is None else len(node.box.corners) for node in nodes)
            footprints = np.full((len(nodes), most, 2), np.nan)
            for number, node in enumerate(nodes):
                if node.box is not None:
                    corners = node.box.corners
                    footprints[number] = corners[np.minimum(np.arange(most), len(corners) - 1)]
            unknown = (np.nan, np.nan)
            stands = np.array([memory.get_position(n) or unknown for n in layout.furniture])
        return cls.make(
            layout.room_labels,
            [node.description for node in nodes],
            np.array([index[node.room] for node in nodes], dtype=np.int64),
            list(layout.furniture),
            np.array(places) if has_positions else None,
            footprints,
            stands,
        )

    @classmethod
    def of_homes(cls, homes: Homes, home: int = 0) -> FloorPlan:
        """Lay out one of some true homes."""
        is_own = homes.is_furniture[home]
        return cls.make(
            [label for label in homes.room_labels[home] if label],
            homes.furniture_labels[home][is_own].tolist(),
            homes.furniture_room[home][is_own],
        )

    @property
    def furniture_box(self) -> np.ndarray:
        """Left, bottom, width, height of each furniture node, (F, 4)."""
        box = np.tile(np.array(BOX) * self.size, (len(self.furniture), 1))
        box[:, :2] += self.corner
        return box

    @property
    def centre(self) -> np.ndarray:
        """Middle of the box of each furniture node, (F, 2)."""
        box = self.furniture_box
        return box[:, :2] + box[:, 2:] / 2

    def list_spots(self, places: np.ndarray) -> np.ndarray:
        """Return a spot of its own for each object, (n,) -> (n, 2); crowded places squeeze.

        Args:
            places: codes of furniture and relation (`PlaceCode`), as in `Homes`, (n,).
        """
        furniture, relation = PlaceCode.split(np.asarray(places, dtype=np.int64))
        is_inside = IS_INSIDE[relation].astype(np.int64)
        _, group, count = np.unique(
            2 * furniture + is_inside, return_inverse=True, return_counts=True
        )
        order = np.argsort(group, kind="stable")
        turn = np.zeros(len(places), dtype=np.int64)  # of each object at its place
        turn[order] = compute_rank_in_group(group[order])
        per_row = np.maximum(DOTS_PER_ROW, -(-count // ROWS.shape[1]))[group]
        row, column = np.divmod(turn, per_row)
        x = BOX[0] + BOX[2] * (column + 0.5) / per_row
        spots = np.stack([x, ROWS[is_inside, row]], axis=1) * self.size
        return self.corner[furniture] + spots


def _lay_out(num_rooms: int, furniture_room: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lay furniture out in rows by room, rooms two by two, or more where there are many."""
    counts = np.bincount(furniture_room, minlength=num_rooms)
    most = int(counts.max(initial=1))
    columns = max(COLUMNS, int(np.ceil(np.sqrt(most) * 1.2))) if most > 16 else COLUMNS
    per_row = 2 if num_rooms <= 6 else int(np.ceil(np.sqrt(num_rooms / 1.5)))
    depth = np.maximum(-(-counts // columns), 1)  # (R,)
    boxes = np.zeros((num_rooms, 4))
    top = 0.0
    for first in range(0, num_rooms, per_row):
        rooms_beside = np.arange(first, min(first + per_row, num_rooms))
        deepest = depth[rooms_beside].max()
        boxes[rooms_beside, 0] = (rooms_beside - first) * (columns + GAP)
        boxes[rooms_beside, 1:] = np.array([top - deepest, columns, deepest])
        top -= deepest + GAP + TITLE
    corner = np.zeros((len(furniture_room), 2))
    for room in range(num_rooms):
        row, column = np.divmod(np.arange(counts[room]), columns)
        left, bottom, _, height = boxes[room]
        corners = np.stack([left + column, bottom + height - 1 - row], axis=1)
        corner[furniture_room == room] = corners
    return boxes, corner


def _place(
    num_rooms: int, furniture_room: np.ndarray, points: np.ndarray, footprints: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Put furniture where it is; a room is the box around what stands in it."""
    apart = np.abs(points[:, None] - points[None]).max(axis=2)  # of squares, not of discs
    apart[apart < 1e-6] = np.inf  # at one position
    nearest = apart.min(axis=1, initial=np.inf)
    nearest = nearest[np.isfinite(nearest)]
    # So that few squares cover each other, and none is a speck.
    size = float(np.clip(np.quantile(nearest, 0.25), 0.5, 1.5)) if len(nearest) else 1.0
    boxes = np.zeros((num_rooms, 4))
    for room in range(num_rooms):
        in_room = points[furniture_room == room]
        if len(in_room) == 0:  # beside the home
            in_room = np.array(
                [[points[:, 0].max(initial=0) + 2 * size, points[:, 1].min(initial=0)]]
            )
        low, high = in_room.min(axis=0) - 0.6 * size, in_room.max(axis=0) + 0.6 * size
        if footprints is not None:
            corners = footprints[furniture_room == room].reshape(-1, 2)
            if np.isfinite(corners).all() and len(corners):
                low, high = corners.min(axis=0) - 0.1, corners.max(axis=0) + 0.1
        boxes[room] = [*low, *(high - low)]
    return boxes, points - size / 2, size

"""Spots: places with extents for what is seen on no known furniture."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sgm.layout.box import FLOOR_THICKNESS, Box
from sgm.mapping.map_changes import MapChanges

_SPOT = "spot"
_SPOT_SIDE = 0.5  # metres of a new spot
_WIDEST_SPOT = 1.2
_SPOT_REACH = 0.6  # metres from the middle of a spot at which a thing is at it, or widens it
_NEAR = 1.5  # metres at which furniture is named as what a spot is by


class MapSpots:
    """The spots of a map, by the furniture that is near.

    Attributes:
        ids: of all of them.
    """

    def __init__(self, changes: MapChanges, ground: float) -> None:
        """Begin with none; `ground` is the height of the floor."""
        self.ids: set[int] = set()
        self._left: set[int] = set()  # of them, those that furniture has left
        self._changes, self._memory, self._ground = changes, changes.memory, ground

    def find(self, center: np.ndarray, bottom: float, eye: np.ndarray) -> int:
        """Return the spot at which a thing lies, which is added if there is none.

        The front of a new one looks to where it was seen from: one can stand there.

        Args:
            center: of the thing in the map, (3,).
            bottom: height of its lower side.
            eye: of the camera that saw it, (3,).
        """
        is_low = bottom < self._ground + 0.15
        top = self._ground if is_low else bottom
        for number in self.ids:
            box = self._get_box(number)
            if abs(box.top - top) < 0.1 and math.dist(box.center[:2], center[:2]) < _SPOT_REACH:
                size = [
                    min(max(side, 2 * abs(away) + 0.2), _WIDEST_SPOT)
                    for side, away in zip(box.size[:2], box.to_own(center).tolist(), strict=False)
                ]
                wider = replace(box, size=(size[0], size[1], box.size[2]))
                self._memory.move_furniture(number, box=wider)
                return number
        x, y = center[:2].tolist()
        thick = FLOOR_THICKNESS if is_low else 0.04
        quarter = math.pi / 2
        yaw = quarter * round(math.atan2(eye[1] - y, eye[0] - x) / quarter)
        box = Box((x, y, top - thick / 2), (_SPOT_SIDE, _SPOT_SIDE, thick), yaw)
        name = self._find_name(box, is_low)
        label, room = "floor" if is_low else _SPOT, self._changes.find_room((x, y))
        spot = self._memory.add_furniture(label, room, name, box=box)
        self.ids.add(spot)
        self._changes.counts["spots"] += 1
        return spot

    def take(self, furniture: int, box: Box) -> None:
        """Let furniture have what was seen at spots that turn out to be it."""
        for spot in sorted(self.ids):
            spot_box = self._get_box(spot)
            is_at = box.bottom + 0.05 <= spot_box.top <= box.top + 0.15
            flat = np.array([spot_box.center[0], spot_box.center[1], box.center[2]])
            if is_at and box.contains(flat, 0.1):
                self._changes.merge(furniture, spot)
                self.ids.discard(spot)

    def make_of(self, furniture: int) -> None:
        """Take furniture from the map that is not there: what was seen there lies on a spot."""
        box = self._get_box(furniture)
        self._changes.counts["furniture gone"] += 1
        self.ids.add(furniture)
        self._left.add(furniture)
        self._memory.name_furniture(furniture, _SPOT, self._find_name(box, is_low=False))

    def remove_left(self) -> bool:
        """Remove spots that furniture has left, where nothing lies; return whether there was one.

        What was seen there since is in the memory by now.
        """
        ids = self._memory.furniture_ids
        self._left &= self.ids & {*ids}
        if not self._left:
            return False
        edges = self._memory.batch.edges
        occupied = {ids[index] for index in edges["furniture"][edges["is_true"]].tolist()}
        empty = self._left - occupied
        for spot in empty:
            self.ids.discard(spot)
            self._memory.remove_furniture(spot)
        self._changes.gone |= empty
        return bool(empty)

    def _get_box(self, spot: int) -> Box:
        box = self._memory.layout.furniture[spot].box
        assert box is not None
        return box

    def _find_name(self, box: Box, is_low: bool) -> str:
        """Return what people call a spot: by the furniture that is nearest."""
        furniture = self._memory.layout.furniture
        near = [
            (float(neighbour.box.compute_distance(np.array(box.center))), neighbour.description)
            for number, neighbour in furniture.items()
            if neighbour.box is not None and number not in self.ids
        ]
        away, name = min(near, default=(math.inf, ""))
        label = "floor" if is_low else _SPOT
        base = f"{label} by the {name}" if away < _NEAR else label
        taken = {neighbour.description for neighbour in furniture.values()}
        names = (base if number == 1 else f"{base} {number}" for number in range(1, len(taken) + 2))
        return next(name for name in names if name not in taken)

"""The boxes of a home as arrays: volumes to look into, and what stands in the way."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.layout.box import Box, read_box, sample_volume
from sgm.layout.furniture import Furniture
from sgm.layout.outline import compute_prism_entries
from sgm.layout.turns import make_upright_turn
from sgm.messages import shorten
from sgm.schema import IS_INSIDE, RELATIONS, PlaceCode

NOWHERE = -1  # in place of a volume or a piece of furniture: at none
_TOUCHING = 0.005  # metres: points of one box on the surface of another one are free


class Scene:
    """P places, which are boxes by furniture id, with V volumes and n points in each volume.

    A volume is what lies at a place in one relation, by its `PlaceCode`.

    Attributes:
        ids: furniture ids, (P,).
        names: of each: its label and its description; none where they are unknown, (P,).
        is_sure: whether depths behind furniture are wrong; else the furniture may be gone.
        center, half: of the boxes, their middles and half their sides, (P, 3).
        rotation: from the own axes of each box to the map, (P, 3, 3).
        radius: half the diagonal of each box, (P,).
        has_inside, has_door, is_open: of each place, bool (P,); doors are shut until `set_open`.
        outlines: footprints of those that are no rectangles, in their own axes, by place.
        has_outline: which of the places these are, bool (P,).
        points: of the volumes in the map, (V, n, 3).
        is_free: which of them are inside no other box, bool (V, n).
        num_free: how many those are, (V,).
        has_volume: whether there is such a volume: none inside a table, bool (V,).
        volume_center, volume_half: middles and half sides of the volumes, (V, 3).
        volume_radius: half their diagonals, (V,).
    """

    def __init__(
        self,
        furniture: Mapping[int, Furniture | Box],
        num_points: int = 128,
        *,
        is_sure: bool = True,
    ) -> None:
        """Take over furniture, or boxes alone, by id; raises TypeError for anything else.

        Furniture without a box is left out.
        """
        self.is_sure = is_sure
        if not isinstance(furniture, Mapping):
            raise TypeError(
                f"furniture must be a mapping, got {shorten(furniture)}. Give furniture by id."
            )
        known = {
            number: piece.box if isinstance(piece, Furniture) else read_box(piece)
            for number, piece in furniture.items()
        }
        boxes = [box for box in known.values() if box is not None]
        self.boxes = boxes
        self.ids = [number for number, box in known.items() if box is not None]
        self.names = [_list_names(furniture[number]) for number in self.ids]
        self.index = {number: place for place, number in enumerate(self.ids)}
        self.center = np.array([box.center for box in boxes]).reshape(-1, 3)
        self.half = np.array([box.size for box in boxes]).reshape(-1, 3) / 2
        self.rotation = make_upright_turn(np.array([box.yaw for box in boxes]))
        self.radius = np.linalg.norm(self.half, axis=1)
        self.has_inside = np.array([box.interior != "none" for box in boxes], dtype=bool)
        self.has_door = np.array([box.has_door for box in boxes], dtype=bool)
        self.is_open = ~self.has_door
        self.outlines = {
            place: box.outline for place, box in enumerate(boxes) if box.outline is not None
        }
        self.has_outline = np.array([box.outline is not None for box in boxes], dtype=bool)
        self._sample(num_points)

    def _sample(self, num_points: int) -> None:
        num_volumes = PlaceCode.count(len(self.boxes))
        self.points = np.zeros((num_volumes, num_points, 3))
        self.is_free = np.zeros((num_volumes, num_points), dtype=bool)
        self.has_volume = np.zeros(num_volumes, dtype=bool)
        self.volume_center, self.volume_half = np.zeros((2, num_volumes, 3))
        for number in range(num_volumes):
            box, relation = (
                self.boxes[PlaceCode.furniture(number)],
                RELATIONS[PlaceCode.relation(number)],
            )
            volume = box.volume(relation)
            if volume is not None:
                self.points[number] = sample_volume(box, relation, num_points)
                self.is_free[number] = self.has_volume[number] = True
                self.volume_center[number] = volume.center
                self.volume_half[number] = np.array(volume.size) / 2
        self.volume_radius = np.linalg.norm(self.volume_half, axis=1)
        for place, box in enumerate(self.boxes):
            distance = np.linalg.norm(self.volume_center - box.center, axis=1)
            near = np.flatnonzero(distance < self.volume_radius + box.radius)
            near = near[PlaceCode.furniture(near) != place]
            self.is_free[near] &= ~box.holds(self.points[near], _TOUCHING)
        self.num_free = self.is_free.sum(axis=1)

    def set_open(self, furniture: int, is_open: bool) -> None:
        """Note whether a door is open; raises errors as `LookBuilder.set_open` says."""
        if furniture not in self.index:
            raise KeyError(
                f"furniture must be the id of one with a box, got {shorten(furniture)}; there are "
                f"{len(self.ids)}. Give it a box."
            )
        place = self.index[furniture]
        if not self.has_door[place]:
            raise ValueError(
                f"furniture must have a door to be opened or shut, got {furniture} with the "
                f"interior {self.boxes[place].interior!r}. Give its Box interior='door'."
            )
        self.is_open[place] = is_open

    def list_volumes(self) -> np.ndarray:
        """Return the volumes that can be looked into now: no shut ones, and none that is full."""
        can_look = ~IS_INSIDE | self.is_open[:, None]  # (P, R)
        return np.flatnonzero(can_look.ravel() & self.has_volume & (self.num_free > 0))

    def to_own(self, points: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Turn points (n, 3) of the map into the axes of places (k,), (n, k, 3)."""
        offset = points[:, None] - self.center[places]
        return np.einsum("nki,kij->nkj", offset, self.rotation[places])


def _list_names(furniture: Furniture | Box) -> tuple[str, ...]:
    """Return what furniture is called; nothing where only its box is known."""
    if isinstance(furniture, Furniture):
        return tuple(dict.fromkeys((furniture.label, furniture.description)))
    return ()


def compute_entries(
    scene: Scene, origin: np.ndarray, directions: np.ndarray, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where rays from a camera (3,) enter and leave boxes (k,).

    In lengths of the directions, (n, 3).

    Returns:
        (n, k) entry, 0 or less where the camera is inside, (n, k) exit, and (n, k) the own axis of
        the side of entry. Where a ray passes by, the entry lies behind the exit.
    """
    start = scene.to_own(origin[None], places)  # (1, k, 3)
    along = np.einsum("ni,kij->nkj", directions, scene.rotation[places])  # (n, k, 3)
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    first, second = (scene.half[places] * sign - start for sign in (-1, 1))
    first, second = first / along, second / along
    near = np.minimum(first, second)
    entry, leave = near.max(axis=2), np.maximum(first, second).min(axis=2)
    for column, place in enumerate(places.tolist()):
        if place in scene.outlines:  # the way within it does not matter
            half = float(scene.half[place, 2])
            outline, rays = scene.outlines[place], along[:, column]
            entry[:, column] = compute_prism_entries(outline, half, start[0, column], rays)
            leave[:, column] = np.where(np.isfinite(entry[:, column]), np.inf, -np.inf)
    return entry, leave, near.argmax(axis=2)

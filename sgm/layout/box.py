"""Extents of furniture: upright boxes in the frame of the map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.checks import read_optional
from sgm.layout.outline import (
    Outline,
    compute_area,
    compute_edge_distance,
    compute_outline_distance,
    contains_points,
    read_outline,
)
from sgm.layout.turns import make_turn, make_upright_turn
from sgm.messages import shorten
from sgm.schema import MOST_METRES, RELATIONS

INTERIORS = ("none", "open", "door")
BELOW_TOP, ABOVE_TOP = 0.03, 0.40  # metres around the top within which things are on top
_WALL = 0.02  # metres of wall, board and door around what is inside
FLOOR_THICKNESS = 0.1  # metres downwards: the top of a floor's box is the floor
_LEAST_SHARE = 0.01  # of its rectangle that an outline fills
LEAST_METRES = 1e-3  # of any side


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box around furniture, in metres in the frame of the map.

    Its own x axis points to the front, from where one looks into it, its y axis to the left, z up.

    Attributes:
        center: x, y, z of the middle.
        size: length along the own x axis, width along y, height.
        yaw: angle from the x axis of the map to the own one, counter-clockwise, in radians.
        interior: what is inside: "none" (a table, a bed), "open" (shelves) or "door", which must
            be open to look into it.
        outline: corners of a footprint that is no rectangle, in the own axes, within the size and
            without an inside (an L-shaped counter, the floor of a room with a bay); None for all
            of the rectangle. `of_polygon` makes it of corners in the map.
    """

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float = 0.0
    interior: str = "none"
    outline: Outline | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for what is no finite box, interior, or outline within the box."""
        for name, value in (("center", self.center), ("size", self.size)):
            read = read_numbers(f"{name} of a box", value, (3,)).tolist()
            object.__setattr__(self, name, tuple(read))
        object.__setattr__(self, "yaw", float(read_numbers("yaw of a box", self.yaw, ())))
        if max(map(abs, (*self.center, *self.size, self.yaw))) > MOST_METRES:
            raise ValueError(
                f"box must lie within {MOST_METRES:g} m, got {shorten(self.size)} at "
                f"{shorten(self.center)}. Give metres and radians in the frame of the map."
            )
        if min(self.size) < LEAST_METRES:
            raise ValueError(
                f"size of a box must be at least {LEAST_METRES} m on every side, got "
                f"{shorten(self.size)} at {shorten(self.center)}. Give length, width and height."
            )
        if self.interior not in INTERIORS:
            raise ValueError(
                f"interior of a box must be one of {', '.join(INTERIORS)}, got "
                f"{shorten(self.interior)} at {shorten(self.center)}. Choose one of these."
            )
        if self.outline is not None:
            self._read_outline()

    def _read_outline(self) -> None:
        outline = read_outline("outline of a box", self.outline)
        if self.interior != "none":
            raise ValueError(
                f"interior of a box with an outline must be none, got {self.interior!r} at "
                f"{shorten(self.center)}. Give the part with an inside a box of its own."
            )
        beyond = np.abs(np.array(outline)) - np.array(self.size[:2]) / 2
        if beyond.max() > LEAST_METRES:
            raise ValueError(
                f"outline of a box must lie within its size, got {shorten(outline)} with "
                f"{shorten(self.size)}. Use Box.of_polygon."
            )
        if compute_area(np.array(outline)) < _LEAST_SHARE * self.size[0] * self.size[1]:
            raise ValueError(
                f"outline of a box must fill {_LEAST_SHARE:.0%} of it or more, got "
                f"{shorten(outline)}. Turn the box (yaw), or make it of two."
            )
        object.__setattr__(self, "outline", outline)

    @classmethod
    def of_polygon(cls, corners: Any, bottom: float, top: float, yaw: float = 0.0) -> Box:
        """Return furniture, or the floor of a room, with a polygon as its footprint.

        Args:
            corners: x, y of each in the map, in the order in which they follow each other.
            bottom: height of its lower side.
            top: height of its upper side.
            yaw: where its front looks to, radians from the x axis.

        Raises:
            ValueError: if the corners are no polygon, or the top is not above the bottom.
        """
        outline = np.array(read_outline("polygon", corners))
        low, high, turn = read_numbers("bottom, top and yaw", (bottom, top, yaw), (3,)).tolist()
        axes = make_turn(turn)
        local = outline @ axes
        middle, size = (local.min(axis=0) + local.max(axis=0)) / 2, np.ptp(local, axis=0)
        x, y = (axes @ middle).tolist()
        length, width = size.tolist()
        corners = tuple(map(tuple, (local - middle).tolist()))
        return cls((x, y, (low + high) / 2), (length, width, high - low), turn, outline=corners)

    @classmethod
    def of_floor(
        cls,
        corner: Sequence[float] | np.ndarray,
        opposite: Sequence[float] | np.ndarray,
        height: float = 0.0,
    ) -> Box:
        """Return the floor of a room whose walls follow the axes of the map.

        Args:
            corner: x, y of one corner.
            opposite: x, y of the opposite one.
            height: z of the floor.
        """
        (x, y), (to_x, to_y) = (
            read_numbers("corner", point, (2,)).tolist() for point in (corner, opposite)
        )
        center = ((x + to_x) / 2, (y + to_y) / 2, height - FLOOR_THICKNESS / 2)
        return cls(center, (abs(to_x - x), abs(to_y - y), FLOOR_THICKNESS))

    @classmethod
    def from_json(cls, data: Any) -> Box:
        """Return what `to_json` wrote; raises ValueError for anything else."""
        if not isinstance(data, list) or len(data) not in (8, 9):
            raise ValueError(
                "box must be a list of x, y, z, length, width, height, yaw and interior, and an "
                f"outline if it has one, got {shorten(data)}. Mend it."
            )
        return cls(tuple(data[:3]), tuple(data[3:6]), *data[6:])

    def to_json(self) -> list[Any]:
        """Return x, y, z, length, width, height, yaw and interior, and the outline, if any."""
        values: list[Any] = [*self.center, *self.size, self.yaw, self.interior]
        return (
            values if self.outline is None else [*values, [list(corner) for corner in self.outline]]
        )

    @property
    def has_door(self) -> bool:
        """Whether it must be opened to look into it."""
        return self.interior == "door"

    @property
    def top(self) -> float:
        """Height of the upper side."""
        return self.center[2] + self.size[2] / 2

    @property
    def bottom(self) -> float:
        """Height of the lower side."""
        return self.center[2] - self.size[2] / 2

    @property
    def radius(self) -> float:
        """Half the diagonal: no point of it is farther from the middle."""
        return math.hypot(*self.size) / 2

    @property
    def flat_radius(self) -> float:
        """Half the diagonal of its footprint as a rectangle."""
        return math.hypot(*self.size[:2]) / 2

    @property
    def corners(self) -> np.ndarray:
        """The footprint counter-clockwise, of a rectangle from front left on, (4 or more, 2)."""
        local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * np.array(self.size[:2]) / 2
        if self.outline is not None:
            local = np.array(self.outline)
        return local @ make_turn(self.yaw).T + self.center[:2]

    @property
    def on_top(self) -> Box:
        """The volume of things on top: the footprint, 3 cm below the upper side to 40 cm above."""
        return self._between(self.top - BELOW_TOP, self.top + ABOVE_TOP)

    @property
    def inside(self) -> Box | None:
        """The volume of things inside, without walls and door; None where there is no inside."""
        if self.interior == "none":
            return None
        length, width, height = (max(side - 2 * _WALL, side / 2) for side in self.size)
        return replace(self, size=(length, width, height), interior="none")

    def volume(self, relation: str) -> Box | None:
        """Return the volume of things "in" or "onTop" of it; None where there is none."""
        if relation == "in":
            return self.inside
        return self.on_top if relation == "onTop" else None

    def shown_volume(self, relation: str) -> Box | None:
        """Return the part of such a volume that can be looked at; None where there is none.

        On top it begins at the upper side: what lies below it is in the volume for things that are
        measured too low, and never in view.
        """
        is_on_top = relation == "onTop"
        return self._between(self.top, self.top + ABOVE_TOP) if is_on_top else self.volume(relation)

    def to_own(self, points: np.ndarray) -> np.ndarray:
        """Turn points of the map (..., 3) into the own axes, from the middle on."""
        offset = np.asarray(points, dtype=float) - self.center
        return offset @ make_upright_turn(self.yaw)

    def to_map(self, local: np.ndarray) -> np.ndarray:
        """Turn points in the own axes (..., 3) into the map; the way back from `to_own`."""
        return local @ make_upright_turn(self.yaw).T + self.center

    def compute_distance(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (..., 3) are from it, (...,); 0 inside."""
        local = self.to_own(points)
        outside = np.maximum(np.abs(local) - np.array(self.size) / 2, 0)
        if self.outline is not None:
            return np.hypot(compute_outline_distance(self.outline, local[..., :2]), outside[..., 2])
        return np.linalg.norm(outside, axis=-1)

    def compute_reach(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (..., 3) are from it and all volumes of things at it, (...,)."""
        volumes = [self, *(self.volume(relation) for relation in RELATIONS)]
        boxes = [volume for volume in volumes if volume is not None]
        return np.min([box.compute_distance(points) for box in boxes], axis=0)

    def contains(self, points: np.ndarray, dilation: float = 0.0) -> np.ndarray:
        """Tell which points (..., 3) are within `dilation` metres of it, bool (...,)."""
        return self.compute_distance(points) <= dilation

    def holds(self, points: np.ndarray, depth: float) -> np.ndarray:
        """Tell which points (..., 3) lie inside, `depth` metres or more from every side."""
        local = self.to_own(points)
        outside = np.abs(local) - np.array(self.size) / 2
        if self.outline is None:
            return outside.max(axis=-1) <= -depth
        flat = local[..., :2]
        is_in = contains_points(self.outline, flat) & (outside[..., 2] <= -depth)
        return is_in & (compute_edge_distance(self.outline, flat) >= depth)

    def _between(self, bottom: float, top: float) -> Box:
        """Return the same footprint between two heights."""
        x, y, _ = self.center
        length, width, _ = self.size
        center, size = (x, y, (bottom + top) / 2), (length, width, top - bottom)
        return replace(self, center=center, size=size, interior="none")


def sample_volume(box: Box, relation: str, num_points: int = 128) -> np.ndarray:
    """Return points that fill the volume of things "in" or "onTop" of a box evenly.

    They are the same in every call, and in the part that can be looked at (`Box.shown_volume`).

    Args:
        box: the furniture.
        relation: such as "in" or "onTop".
        num_points: n.

    Returns:
        (n, 3) in the map; (0, 3) where there is no such volume, as "in" a table.

    Source: the additive recurrence R3 of Roberts (2018), "The unreasonable effectiveness of
    quasirandom sequences".
    """
    volume = box.shown_volume(relation)
    if volume is None:
        return np.empty((0, 3))
    root = 1.2207440846057596  # of x^4 = x + 1
    num_tried = num_points
    while True:
        steps = np.arange(1, num_tried + 1)[:, None] * root ** -np.arange(1.0, 4.0)
        local = ((0.5 + steps) % 1 - 0.5) * volume.size
        if volume.outline is not None:
            local = local[contains_points(volume.outline, local[:, :2])]
        if len(local) >= num_points:
            return volume.to_map(local[:num_points])
        num_tried *= 2


def read_box(box: Any) -> Box | None:
    """Return a box; None stays None, and anything else raises TypeError."""
    hint = "Write Box((x, y, z), (length, width, height)) of sgm.eyes."
    return read_optional("box", box, Box, hint)

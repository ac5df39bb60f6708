"""From where a camera looked at furniture, and how wide."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.messages import shorten


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A camera's cone of view over the floor plan, in the frame of the map.

    Attributes:
        x, y, z: of the camera, metres.
        yaw: direction of the middle of the image, from the x axis counter-clockwise, radians.
        angle: between the left and the right side of the image, radians.
        reach: farthest distance at which things are seen, metres.
    """

    x: float
    y: float
    z: float
    yaw: float
    angle: float
    reach: float

    def __post_init__(self) -> None:
        """Raise ValueError for what is no finite number, or no camera can have."""
        read = read_numbers("viewpoint", astuple(self), (6,))
        for name, value in zip(self.__slots__, read.tolist(), strict=True):
            object.__setattr__(self, name, value)
        if not 0 < self.angle < math.pi or not self.reach > 0:
            raise ValueError(
                "angle and reach of a viewpoint must lie above 0, the angle below pi, got "
                f"{self.angle:g} and {self.reach:g}. Give radians and metres."
            )

    @classmethod
    def from_json(cls, data: Any) -> Viewpoint:
        """Return what `to_json` wrote; raises ValueError for anything else."""
        if not isinstance(data, list) or len(data) != len(cls.__slots__):
            raise ValueError(
                "viewpoint must be a list of x, y, z, yaw, angle and reach, got "
                f"{shorten(data)}. Mend it."
            )
        return cls(*data)

    def to_json(self) -> list[float]:
        """Return x, y, z, yaw, angle and reach, to millimetres and milliradians."""
        return [round(value, 3) for value in astuple(self)]

    def compute_corners(self, farthest: float = math.inf) -> np.ndarray:
        """Return the camera and the left and right end of what it sees on the plan, (3, 2).

        The cone is cut off at the distance `farthest`, in metres, if that is within its reach.
        """
        away = min(self.reach, farthest)
        turns = self.yaw + np.array([0.5, -0.5]) * self.angle
        ends = np.column_stack([np.cos(turns), np.sin(turns)]) * away
        return np.vstack([np.zeros(2), ends]) + np.array([self.x, self.y])

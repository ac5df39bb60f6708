"""A pinhole camera: its intrinsics, its pose in the map, and projection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.checks import check_at_least
from sgm.messages import shorten

_MOST_PIXELS = 1 << 15  # of a side of an image
_UNIT = np.eye(3)
_SKEW = 1e-3  # by which a product of a rotation and its inverse may miss 1 or 0
_LEAST_DEPTH = 1e-6  # metres: what is nearer to the camera, or behind it, has no pixel


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """What a pinhole camera without distortion sees: a pixel is (fx x / z + cx, fy y / z + cy).

    Whole numbers are the middles of pixels, as in OpenCV and ROS: the image reaches from -.5 to
    width - .5.

    Attributes:
        fx, fy: focal lengths in pixels.
        cx, cy: pixel of the optical axis.
        width, height: pixels of the image.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        """Raise ValueError for what no image could have."""
        values = (self.fx, self.fy, self.cx, self.cy)
        lengths = read_numbers("fx, fy, cx, cy of intrinsics", values, (4,))[:2]
        if lengths.min() <= 0:
            raise ValueError(
                f"focal lengths fx and fy must be above 0, got {lengths.tolist()}. Take them from "
                "CameraInfo, or from a calibration."
            )
        for name, side in (("width", self.width), ("height", self.height)):
            is_whole = isinstance(side, (int, np.integer)) and not isinstance(side, bool)
            if not is_whole or not 1 <= side <= _MOST_PIXELS:
                raise ValueError(
                    f"{name} of an image must be a whole number from 1 to {_MOST_PIXELS}, got "
                    f"{shorten(side)}. Give pixels."
                )

    @classmethod
    def from_matrix(cls, matrix: Any, width: int, height: int) -> Intrinsics:
        """Return those of a camera matrix, such as `k` of ROS's CameraInfo: (9,) or (3, 3).

        Raises:
            ValueError: if it is no such matrix, or singular.
        """
        k = read_numbers("camera matrix", matrix, (9,), (3, 3)).reshape(9)
        return cls(float(k[0]), float(k[4]), float(k[2]), float(k[5]), width, height)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (n, 2) of points in the camera's frame (n, 3).

        Columns, then rows. What is not in front of the camera has the pixel nan.
        """
        depth = np.where(points[:, 2] > _LEAST_DEPTH, points[:, 2], np.nan)
        return points[:, :2] / depth[:, None] * (self.fx, self.fy) + (self.cx, self.cy)

    def unproject(self, pixels: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Return the points in the camera's frame (n, 3) of pixels (n, 2) with depths (n,)."""
        flat = (np.asarray(pixels, dtype=float) - (self.cx, self.cy)) / (self.fx, self.fy)
        depth = np.asarray(depth, dtype=float)
        return np.column_stack([flat * depth[:, None], depth])

    def contains(self, pixels: np.ndarray) -> np.ndarray:
        """Tell which pixels (n, 2) lie in the image, bool (n,)."""
        end = np.array([self.width - 0.5, self.height - 0.5])
        return np.all((pixels >= -0.5) & (pixels < end), axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a camera is in the map, and how it is turned.

    The frame of the camera is the optical one of ROS and OpenCV: x to the right of the image, y
    down, z forward.

    Attributes:
        rotation: from the camera's frame to the map, (3, 3); its columns are the camera's axes.
        position: of the camera in the map, metres, (3,).
        position_sd: standard deviation of the position in each direction, metres.
        angle_sd: standard deviation of the direction of view, radians.
    """

    rotation: np.ndarray
    position: np.ndarray
    position_sd: float = 0.0
    angle_sd: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for a rotation that is none, or a value that is not finite."""
        rotation = read_numbers("rotation", self.rotation, (3, 3))
        position = read_numbers("position of a camera", self.position, (3,))
        is_rotation = np.abs(rotation @ rotation.T - _UNIT).max() <= _SKEW
        if not is_rotation or np.linalg.det(rotation) < 0:
            raise ValueError(
                "rotation must be an orthonormal matrix with determinant 1, got "
                f"{shorten(rotation.tolist())}. Give that from the camera's frame to the map."
            )
        check_at_least(0, position_sd=self.position_sd, angle_sd=self.angle_sd)
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "position", position)

    @classmethod
    def from_matrix(cls, matrix: Any, position_sd: float = 0.0, angle_sd: float = 0.0) -> Pose:
        """Return that of a matrix from the camera's optical frame to the map, (4, 4) or (3, 4).

        Raises:
            ValueError: if it is none.
        """
        read = read_numbers("matrix of a pose", matrix, (4, 4), (3, 4))
        if len(read) == 4 and not np.allclose(read[3], (0, 0, 0, 1)):
            raise ValueError(
                f"last row of a pose must be 0, 0, 0, 1, got {shorten(read[3].tolist())}. Give the "
                "matrix from the camera's frame to the map."
            )
        return cls(read[:3, :3], read[:3, 3], position_sd, angle_sd)

    @classmethod
    def from_quaternion(
        cls,
        position: Sequence[float] | np.ndarray,
        quaternion: Sequence[float] | np.ndarray,
        position_sd: float = 0.0,
        angle_sd: float = 0.0,
    ) -> Pose:
        """Return that of a transform as tf2 gives it, from the optical frame to the map.

        The position is x, y, z, the quaternion x, y, z, w.

        Raises:
            ValueError: if the quaternion is zero, or a value is not finite.
        """
        x, y, z, w = read_numbers("quaternion", quaternion, (4,))
        norm = math.hypot(x, y, z, w)
        if abs(norm - 1) > 0.01:
            raise ValueError(
                f"quaternion must have the length 1, got {norm:.3g} of {shorten(quaternion)}. Give "
                "x, y, z, w."
            )
        rotation = make_rotation((x / norm, y / norm, z / norm, w / norm))
        return cls(rotation, np.array(position, dtype=float), position_sd, angle_sd)

    @classmethod
    def look_at(
        cls,
        position: Sequence[float] | np.ndarray,
        target: Sequence[float] | np.ndarray,
        position_sd: float = 0.0,
        angle_sd: float = 0.0,
    ) -> Pose:
        """Return that of an upright camera at a position that looks at a target, x, y, z each.

        Raises:
            ValueError: if they are one point, or one above the other.
        """
        eye = read_numbers("position of a camera", position, (3,))
        forward = read_numbers("target of a camera", target, (3,)) - eye
        right = np.array([forward[1], -forward[0], 0.0])
        if np.linalg.norm(right) < 1e-9:
            raise ValueError(
                f"target must not be above or below the camera, got {shorten(target)} from "
                f"{shorten(position)}. Use Pose(rotation, position) for that."
            )
        forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
        down = np.cross(forward, right)
        return cls(np.column_stack([right, down, forward]), eye, position_sd, angle_sd)

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """Turn points of the map (n, 3) into the camera's frame."""
        return (np.asarray(points, dtype=float) - self.position) @ self.rotation

    def to_map(self, points: np.ndarray) -> np.ndarray:
        """Turn points of the camera's frame (n, 3) into the map."""
        return np.asarray(points, dtype=float) @ self.rotation.T + self.position

    def compute_sd(self, distance: np.ndarray) -> np.ndarray:
        """Return the standard deviations of what is measured at distances, metres."""
        return np.hypot(self.position_sd, self.angle_sd * distance)


def make_rotation(quaternion: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of a quaternion x, y, z, w of length 1."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )

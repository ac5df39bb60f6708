"""What a detector says of one frame, and where in the map that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.camera.camera_view import CameraView
from sgm.checks import check_shares
from sgm.messages import shorten
from sgm.names.words import read_words

_MOST_RADIUS = 0.25  # metres: what a box in pixels is wider than that may be two things, or a part
_CORNERS = np.array([(0, 0, 0), *product((-1, 1), repeat=3)])  # in half sides, the middle first
_USUAL_SIZE = (0.08, 0.08, 0.1)  # metres, where it is unknown


@dataclass(frozen=True, slots=True)
class Detection:
    """One thing that a detector found in one frame; it has a box in pixels, a center, or both.

    Attributes:
        name: what it is, such as "large red mug".
        score: probability that it is there and called so.
        box: left, top, right, bottom in pixels of the image.
        center: of the thing in the map, metres; None where it is to be found by the depth image.
        size: of the thing in the map, metres along its axes, if known.
        track: the detector's number for this one thing over frames, if it has any.
        embedding: a vector of the detector, for the caller's use.
    """

    name: str
    score: float = 1.0
    box: tuple[float, float, float, float] | None = None
    center: tuple[float, float, float] | None = None
    size: tuple[float, float, float] | None = None
    track: int | str | None = None
    embedding: Sequence[float] | np.ndarray | None = None

    if TYPE_CHECKING:  # what it takes is more than what it holds

        def __init__(
            self,
            name: str,
            score: float = 1.0,
            box: Sequence[float] | np.ndarray | None = None,
            center: Sequence[float] | np.ndarray | None = None,
            size: Sequence[float] | np.ndarray | None = None,
            track: int | str | None = None,
            embedding: Sequence[float] | np.ndarray | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Raise ValueError for a name, score or number that is none, or a thing of no place."""
        read_words("name of a detection", self.name)
        check_shares(**{f"score of {shorten(self.name)}": self.score})
        object.__setattr__(self, "score", float(self.score))
        for field, num in (("box", 4), ("center", 3), ("size", 3)):
            value = getattr(self, field)
            if value is not None:
                value_name = f"{field} of {shorten(self.name)}"
                object.__setattr__(
                    self, field, tuple(read_numbers(value_name, value, (num,)).tolist())
                )
        if self.size is not None and min(self.size) < 0:
            raise ValueError(
                f"size of a detection must be 0 or more along each axis, got {shorten(self.size)} "
                f"for {shorten(self.name)}. Give metres."
            )
        if self.box is None and self.center is None:
            raise ValueError(
                f"detection must have a box or a center, got neither for {shorten(self.name)}. "
                "Give left, top, right, bottom in pixels, or x, y, z in the map."
            )
        if self.box is not None and (self.box[0] > self.box[2] or self.box[1] > self.box[3]):
            raise ValueError(
                "box of a detection must be left, top, right, bottom, got "
                f"{shorten(self.box)} for {shorten(self.name)}. Put the smaller numbers first."
            )

    def list_points(self) -> np.ndarray | None:
        """Return its middle and its corners in the map, (9, 3); None for a box in pixels."""
        if self.center is None:
            return None
        return np.array(self.center) + _CORNERS * np.array(self.size or (0.0, 0.0, 0.0)) / 2


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Where one thing was measured to be in a frame, and how large.

    Attributes:
        center: its middle in the map, (3,).
        radius: half of how wide it is, metres.
        height: metres.
        sd: standard deviation of the middle, by the uncertainty of the pose, metres.
        depth_sd: standard deviation of the middle along the ray, by that of its depth, metres.
    """

    center: np.ndarray
    radius: float
    height: float
    sd: float
    depth_sd: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """The k detections of a frame that have a place in the map.

    Attributes:
        detections: k of them.
        center: their middles in the map, (k, 3).
        radius: half of how wide they are, metres, (k,).
        height: how high they are, metres, (k,).
        sd, depth_sd: standard deviations of the middle, by the uncertainty of the pose and of the
            depth, metres, (k,).
    """

    detections: tuple[Detection, ...]
    center: np.ndarray
    radius: np.ndarray
    height: np.ndarray
    sd: np.ndarray
    depth_sd: np.ndarray

    def get(self, row: int) -> Measured:
        """Return one of them."""
        numbers = (self.radius, self.height, self.sd, self.depth_sd)
        return Measured(self.center[row], *(float(values[row]) for values in numbers))

    @property
    def bottom(self) -> np.ndarray:
        """Height of their lower sides, (k,)."""
        return self.center[:, 2] - self.height / 2


def locate(view: CameraView, detections: Sequence[Detection]) -> tuple[Located, list[Detection]]:
    """Find where detections are, by their own centers or the depth image.

    A thing in the image begins at the depth in the middle of its box, and its middle lies behind
    that by half of how thick it is along the ray.

    Returns:
        Those with a place, and those without: no center, and no depth there.
    """
    with_box = [detection for detection in detections if detection.center is None]
    boxes = np.array([detection.box for detection in with_box], dtype=float).reshape(-1, 4)
    depth, depth_sd = view.measure_boxes(boxes)
    is_known = np.isfinite(depth)
    found = [with_box[number] for number in np.flatnonzero(is_known)]
    lost = [with_box[number] for number in np.flatnonzero(~is_known)]
    center, radius, height = _locate_boxes(view, boxes[is_known], depth[is_known])
    with_center = [detection for detection in detections if detection.center is not None]
    center = np.vstack(
        [center, np.array([detection.center for detection in with_center]).reshape(-1, 3)]
    )
    size = np.array([detection.size or _USUAL_SIZE for detection in with_center]).reshape(-1, 3)
    radius = np.append(radius, (size[:, 0] / 2 + size[:, 1] / 2) / 2)
    height = np.append(height, np.maximum(size[:, 2], 0.01))
    distance = np.linalg.norm(center - view.pose.position, axis=1)
    sd = view.pose.compute_sd(distance)
    depth_sd = np.append(depth_sd[is_known], np.zeros(len(with_center)))
    return Located((*found, *with_center), center, radius, height, sd, depth_sd), lost


def _locate_boxes(
    view: CameraView, boxes: np.ndarray, depth: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return middles (k, 3), radii and heights (k,) of boxes in pixels (k, 4) at depths (k,)."""
    pose, intrinsics = view.pose, view.intrinsics
    surface = pose.to_map(intrinsics.unproject((boxes[:, :2] + boxes[:, 2:]) / 2, depth))
    ray = surface - pose.position
    ray /= np.linalg.norm(ray, axis=1, keepdims=True) + 1e-12
    wide = (boxes[:, 2] - boxes[:, 0]) * depth / intrinsics.fx
    tall = (boxes[:, 3] - boxes[:, 1]) * depth / intrinsics.fy
    radius = np.minimum(wide / 2, _MOST_RADIUS)
    # From above one sees the upper side, too: tall = height * cos + 2 * radius * sin.
    sine = np.abs(ray[:, 2])
    cosine = np.sqrt(np.maximum(1 - sine**2, 0.01))
    height = np.clip((tall - 2 * radius * sine) / cosine, 0.01, None)
    thick = compute_half_chord(ray, radius, height)
    return surface + ray * thick[:, None], radius, height


def compute_half_chord(ray: np.ndarray, radius: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return half of how thick ellipsoids are along rays through their middles, metres, (k,).

    The rays are of length 1, (k, 3), radii half axes in the plane, heights full axes upwards, (k,).
    """
    flat = np.hypot(ray[:, 0], ray[:, 1]) / np.maximum(radius, 1e-3)
    up = ray[:, 2] / np.maximum(height / 2, 1e-3)
    return 1 / np.hypot(flat, up)

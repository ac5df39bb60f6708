"""How far above the surface around it the depth at a flat thing is: a plate, or a bare table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.camera.camera_view import CameraView

_GRID = 24  # pixels along each side of the window around a thing
_CIRCLE = np.linspace(0, 2 * np.pi, 8, endpoint=False)
_WITHIN, _BEYOND = 0.95, 1.2  # of half a thing's least and largest width: it, and what is around
_RING = 0.1  # metres of what is around a thing that are compared with it
_BAND = 0.05  # metres above and below what a thing is thought to fill: beyond is something else
_LEAST_PIXELS = 6  # of a thing, and of what is around
_LEAST_SHARE = 0.5  # of the pixels of a thing that measured something about as high
_MAD_TO_SD = 1.4826  # of a normal distribution
_MEDIAN_VARIANCE = np.pi / 2  # of a median, by that of a mean


@dataclass(slots=True, eq=False)
class Relief:
    """The mean over frames of how far the depth at a thing is above what is around it.

    Attributes:
        height: of the mean, metres.
        weight: sum of the inverse variances, 1/m2.
        num_frames: that measured it.
    """

    height: float = 0.0
    weight: float = 0.0
    num_frames: int = 0

    def add(self, height: float, sd: float) -> None:
        """Take in what one frame measured, and its standard deviation, metres."""
        weight = 1 / sd**2
        self.weight += weight
        self.height += weight / self.weight * (height - self.height)
        self.num_frames += 1

    @property
    def sd(self) -> float:
        """Standard deviation of the mean, metres; infinite without a frame."""
        return float(1 / np.sqrt(self.weight)) if self.weight else np.inf


def measure_relief(
    view: CameraView, center: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far above what is around it the depth at each of n things is, and how sure.

    The median height of what the pixels within a thing measured, less that of the pixels around it.
    An error of the pose or of the map, which moves both, makes no difference.

    Args:
        view: the frame, with a depth image.
        center: of the things in the map, (n, 3).
        size: along the axes of the map, metres, (n, 3).

    Returns:
        Heights in metres, nan where too little was measured, and their standard deviations, (n,).
    """
    half = np.sort(size[:, :2] / 2, axis=1)  # (n, 2), the smaller one first
    far = view.pose.compute_sd(np.linalg.norm(center - view.pose.position, axis=1))
    within = _WITHIN * half[:, 0] - far
    beyond = _BEYOND * np.hypot(half[:, 0], half[:, 1]) + far
    bottom = center[:, 2] - size[:, 2] / 2
    pixels, is_known = _list_pixels(view, center, beyond + _RING, bottom)  # (n, p, 2), (n, p)
    points, is_measured, _ = view.measure_pixels(pixels.reshape(-1, 2))
    points = points.reshape(*pixels.shape[:2], 3)
    is_known &= is_measured.reshape(is_known.shape)
    away = np.linalg.norm(points[..., :2] - center[:, None, :2], axis=2)
    above = points[..., 2] - bottom[:, None]
    is_within = is_known & (away < within[:, None])
    is_around = is_known & (away > beyond[:, None]) & (away < beyond[:, None] + _RING)
    is_near = (above > -_BAND) & (above < size[:, 2:] + _BAND)
    inner, inner_variance, num_inner = _summarise(above, is_within & is_near)
    outer, outer_variance, num_outer = _summarise(above, is_around & is_near)
    is_enough = (num_inner >= _LEAST_PIXELS) & (num_outer >= _LEAST_PIXELS)
    is_enough &= num_inner >= _LEAST_SHARE * is_within.sum(axis=1)
    # A camera that is tilted by less than its pose says sees a level table as a slope.
    slope = view.pose.angle_sd * (beyond + _RING) / 2
    sd = np.sqrt(inner_variance + outer_variance + slope**2)
    return np.where(is_enough, inner - outer, np.nan), sd


def _list_pixels(
    view: CameraView, center: np.ndarray, reach: np.ndarray, bottom: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return whole pixels of a window around each thing, (n, p, 2), and which count, (n, p).

    `reach` is how far around the middle the window goes, and `bottom` at which height, metres.
    """
    circle = np.column_stack([np.cos(_CIRCLE), np.sin(_CIRCLE), np.zeros(len(_CIRCLE))])
    foot = np.column_stack([center[:, :2], bottom])
    camera = view.pose.to_camera((foot[:, None] + reach[:, None, None] * circle).reshape(-1, 3))
    is_ahead = camera[:, 2].reshape(len(center), -1).min(axis=1, initial=np.inf) > 0
    camera[:, 2] = np.maximum(camera[:, 2], 1e-3)
    corners = view.intrinsics.project(camera).reshape(len(center), -1, 2)
    size = np.array([view.intrinsics.width, view.intrinsics.height])
    low, high = (np.clip(edge, 0, size - 1) for edge in (corners.min(axis=1), corners.max(axis=1)))
    steps = np.linspace(0, 1, _GRID)
    columns, rows = (
        np.rint(low[:, side, None] + (high - low)[:, side, None] * steps) for side in (0, 1)
    )
    # A window of fewer pixels than the grid has each of them once.
    right, down = (np.diff(along, axis=1, prepend=-1) for along in (columns, rows))
    is_known = (down[:, :, None] > 0) & (right[:, None, :] > 0) & is_ahead[:, None, None]
    pixels = np.stack(np.broadcast_arrays(columns[:, None, :], rows[:, :, None]), axis=-1)
    return pixels.reshape(len(center), -1, 2), is_known.reshape(len(center), -1)


def _summarise(
    values: np.ndarray, is_used: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the median of the used values of each row (n, p), its variance, and how many, (n,)."""
    median, number = _compute_median(values, is_used)
    deviation, _ = _compute_median(np.abs(values - median[:, None]), is_used)
    variance = _MEDIAN_VARIANCE * (_MAD_TO_SD * deviation) ** 2 / np.maximum(number, 1)
    return median, variance, number


def _compute_median(values: np.ndarray, is_used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the median of the used values of each row (n, p), 0 for none, and how many, (n,)."""
    number = is_used.sum(axis=1)
    ordered = np.sort(np.where(is_used, values, np.inf), axis=1)
    ordered[number == 0] = 0.0
    rows = np.arange(len(values))
    low = ordered[rows, np.maximum(number - 1, 0) // 2]
    high = ordered[rows, np.minimum(number // 2, values.shape[1] - 1)]
    return (low + high) / 2, number

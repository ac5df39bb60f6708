"""The points of space that detections of furniture show, and those beside them, of one frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import Detection

_STEPS = np.linspace(-1.05, 1.05, 22)  # of the sides of a box in pixels: what is beside it, too
_GRID = np.stack(np.meshgrid(_STEPS, _STEPS), axis=-1).reshape(-1, 2)  # (g, 2)
_IS_WITHIN = np.abs(_GRID).max(axis=1) <= 0.5  # of the sides from the middle
_NEAREST = 0.1  # share of the points that are nearer than furniture begins
_MOST_BEHIND = 2.5  # metres that furniture reaches behind what of it is nearest, at most
_MOST_BEYOND = 0.5  # share of a detection that shows what is out of reach: so is what it is of
_ABOVE_FLOOR = 0.04  # metres: what is lower is floor

Points = tuple[np.ndarray, np.ndarray]  # (n, 3), and which of them are within the detection, (n,)
_NONE: Points = np.empty((0, 3)), np.empty(0, dtype=bool)


def measure_furniture(
    view: CameraView,
    detections: Sequence[Detection],
    others: Sequence[Detection],
    ground: float,
) -> list[Points]:
    """Return the points that each detection shows, none where it is of what is out of reach.

    Args:
        view: the frame.
        detections: of furniture.
        others: of things: what they show before furniture is not furniture.
        ground: height of the floor.
    """
    found = [_NONE if one.box is not None else _fill(one) for one in detections]
    rows = [row for row, one in enumerate(detections) if one.box is not None]
    if not rows or not view.has_depth:
        return found
    boxes = [one.box for one in (*detections, *others) if one.box is not None]
    near = np.array(boxes).reshape(-1, 4)
    own = near[: len(rows)]
    middle, sides = (own[:, :2] + own[:, 2:]) / 2, own[:, 2:] - own[:, :2]
    pixels = middle[:, None] + sides[:, None] * _GRID  # (k, g, 2)
    flat = pixels.reshape(-1, 2)
    is_kept = view.intrinsics.contains(flat).reshape(len(rows), -1)
    is_kept[:, _IS_WITHIN] &= ~_find_covered(pixels[:, _IS_WITHIN], own, near)
    kept = np.flatnonzero(is_kept)
    points, is_known, is_beyond = view.measure_pixels(flat[kept])
    ends = np.cumsum(is_kept.sum(axis=1))[:-1]
    is_within = np.broadcast_to(_IS_WITHIN, is_kept.shape).reshape(-1)[kept]
    is_known &= points[:, 2] > ground + _ABOVE_FLOOR
    away = np.linalg.norm(points - view.pose.position, axis=1)
    parts = (np.split(values, ends) for values in (points, is_within, is_known, is_beyond, away))
    for row, *part in zip(rows, *parts, strict=True):
        found[row] = _choose(*part)
    return found


def _choose(
    points: np.ndarray,
    is_within: np.ndarray,
    is_known: np.ndarray,
    is_beyond: np.ndarray,
    away: np.ndarray,
) -> Points:
    """Return those points (n, 3) of a detection that may be of what it is of."""
    if is_beyond[is_within].sum() > _MOST_BEYOND * is_within.sum():
        return _NONE  # what is nearer stands before it
    inner = np.sort(away[is_within & is_known])
    if not len(inner):
        return _NONE
    at = _NEAREST * (len(inner) - 1)  # a quantile
    low = int(at)
    nearest = inner[low] + (at - low) * (inner[min(low + 1, len(inner) - 1)] - inner[low])
    is_near = is_known & (away < nearest + _MOST_BEHIND)
    return points[is_near], is_within[is_near]


def _find_covered(pixels: np.ndarray, own: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Tell which pixels (k, g, 2) of boxes (k, 4) lie in smaller ones of (m, 4), bool (k, g).

    What is smaller is before furniture, or on it.
    """
    area = np.prod(near[:, 2:] - near[:, :2], axis=1)
    is_over = area < area[: len(own), None]
    is_over &= (near[:, :2] < own[:, None, 2:]).all(axis=2)
    is_over &= (near[:, 2:] > own[:, None, :2]).all(axis=2)
    covered = np.zeros(pixels.shape[:2], dtype=bool)
    for row in np.flatnonzero(is_over.any(axis=1)).tolist():
        other, at = near[is_over[row]], pixels[row][:, None]
        covered[row] = ((at > other[:, :2]) & (at < other[:, 2:])).all(axis=2).any(axis=1)
    return covered


def _fill(detection: Detection) -> Points:
    """Return points on a box in space, all of them within the detection; none without a size."""
    if detection.size is None or not min(detection.size) > 0:
        return _NONE
    assert detection.center is not None
    steps = np.linspace(-0.5, 0.5, 9)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    grid = grid[np.abs(grid).max(axis=1) == 0.5]
    points = np.array(detection.center) + grid * np.array(detection.size)
    return points, np.ones(len(points), dtype=bool)

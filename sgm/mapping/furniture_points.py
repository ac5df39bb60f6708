"""The points of space that detections of furniture show, and those beside them, of one frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection

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
    found = [_NONE if detection.box is not None else _fill(detection) for detection in detections]
    numbers = [number for number, detection in enumerate(detections) if detection.box is not None]
    if not numbers or not view.has_depth:
        return found
    boxes = [detection.box for detection in (*detections, *others) if detection.box is not None]
    near = np.array(boxes).reshape(-1, 4)
    of_furniture = near[: len(numbers)]
    low, high = of_furniture[:, :2], of_furniture[:, 2:]
    middle, sides = (low + high) / 2, high - low
    pixels = middle[:, None] + sides[:, None] * _GRID  # (k, g, 2)
    flat = pixels.reshape(-1, 2)
    is_kept = view.intrinsics.contains(flat).reshape(len(numbers), -1)
    is_kept[:, _IS_WITHIN] &= ~_find_covered(pixels[:, _IS_WITHIN], of_furniture, near)
    points, is_known, is_beyond = view.measure_pixels(flat)
    is_known &= points[:, 2] > ground + _ABOVE_FLOOR
    away = np.linalg.norm(points - view.pose.position, axis=1).reshape(is_kept.shape)
    is_known, is_beyond = is_known.reshape(is_kept.shape), is_beyond.reshape(is_kept.shape)
    is_chosen = is_kept & is_known & (away < _find_ends(is_kept, is_known, is_beyond, away))
    points = points.reshape(*is_kept.shape, 3)
    for number, shown, chosen in zip(numbers, points, is_chosen, strict=True):
        found[number] = shown[chosen], _IS_WITHIN[chosen]
    return found


def _find_ends(
    is_kept: np.ndarray, is_known: np.ndarray, is_beyond: np.ndarray, away: np.ndarray
) -> np.ndarray:
    """Return how far away what each of k detections is of may be, (k, 1), of its points (k, g).

    0 where most of it shows what is out of reach: what is nearer stands before it.
    """
    is_kept, is_known, is_beyond, away = (
        part[:, _IS_WITHIN] for part in (is_kept, is_known, is_beyond, away)
    )
    is_far = (is_kept & is_beyond).sum(axis=1) > _MOST_BEYOND * is_kept.sum(axis=1)
    is_known = is_known & is_kept
    num_known = is_known.sum(axis=1)
    ordered = np.sort(np.where(is_known, away, np.inf), axis=1)
    quantile = _NEAREST * np.maximum(num_known - 1, 0)
    low, row = quantile.astype(np.int64), np.arange(len(away))
    first = ordered[row, low]
    second = ordered[row, np.minimum(low + 1, np.maximum(num_known - 1, 0))]
    is_some = (num_known > 0) & ~is_far
    first, second = np.where(is_some, first, 0), np.where(is_some, second, 0)
    nearest = first + (quantile - low) * (second - first)
    return np.where(is_some, nearest + _MOST_BEHIND, 0)[:, None]


def _find_covered(pixels: np.ndarray, boxes: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Tell which pixels (k, g, 2) of boxes (k, 4) lie in smaller ones of (m, 4), bool (k, g).

    What is smaller is before furniture, or on it.
    """
    area = np.prod(near[:, 2:] - near[:, :2], axis=1)
    is_over = area < area[: len(boxes), None]
    is_over &= (near[:, :2] < boxes[:, None, 2:]).all(axis=2)
    is_over &= (near[:, 2:] > boxes[:, None, :2]).all(axis=2)
    covered = np.zeros(pixels.shape[:2], dtype=bool)
    for row in np.flatnonzero(is_over.any(axis=1)).tolist():
        other, pixel = near[is_over[row]], pixels[row][:, None]
        covered[row] = ((pixel > other[:, :2]) & (pixel < other[:, 2:])).all(axis=2).any(axis=1)
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

"""Whether the rays through things went on behind them, ended at them, or ended before them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import compute_half_chord

IN_SIGHT = 3.0  # standard deviations by which a spot may be wrong: one in 400 is by more
_LEAST_SIZE = 0.015  # metres: of what looks smaller all ways round, only a corner was seen
# Where else a thing may be: to the left of its spot, and towards the camera. In shares of how far.
_APART = 0.25
_STEPS = np.arange(_APART, 1 + _APART, _APART)
_LEFT = np.concatenate(([0.0], -_STEPS, _STEPS, np.zeros_like(_STEPS)))
_TOWARDS = np.concatenate((np.zeros(1 + 2 * len(_STEPS)), _STEPS))
_SUPPORT = 0.015  # metres of what is behind a thing: less cannot be told from the thing itself


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """n things, as they are seen.

    Attributes:
        center: their middles in the map, (n, 3).
        radius, height: of each, metres, (n,).
        sd: standard deviations of the middles, metres, (n,).
        volume: numbers of the volumes that they lie in, (n,).
    """

    center: np.ndarray
    radius: np.ndarray
    height: np.ndarray
    sd: np.ndarray
    volume: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Traced:
    """What rays tell of n things.

    Attributes:
        is_through: whether the rays went on behind each, bool (n,).
        is_in_front: whether something was measured in front of a part of it, bool (n,).
        farthest: how far the ray through its middle, or a part above or below, went on behind that
            at most; below 0 where all of them ended before it, metres, nan if unknown, (n,).
    """

    is_through: np.ndarray
    is_in_front: np.ndarray
    farthest: np.ndarray


def trace_rays(
    view: CameraView, bodies: Bodies, through_margin: float, *, is_flat_gone: bool = True
) -> Traced:
    """Tell what the rays of a frame towards n things tell of them.

    A ray went through if it was measured to go on behind the thing (`_compute_least_behind`).

    A thing may be beside or before where it was measured, by the uncertainty of both poses and of
    its depth. Rays that it would meet there must have gone through as well. Of a thing that
    fits between them no ray tells, and none of one of which only a corner was seen: the rest lies
    beside its middle.

    Args:
        view: the frame.
        bodies: the things.
        through_margin: metres that a ray must go on behind a thing.
        is_flat_gone: whether a flat thing is gone where nothing was before it, and what bears it
            was measured; else the rays must have gone through that, too.
    """
    center, radius, height = bodies.center, bodies.radius, bodies.height
    ray = center - view.pose.position
    distance = np.linalg.norm(ray, axis=1)
    ray = ray / np.maximum(distance, 1e-9)[:, None]
    half = compute_half_chord(ray, radius, height)
    sd = np.hypot(bodies.sd, view.pose.compute_sd(distance))
    far = np.maximum(IN_SIGHT * sd - radius, 0)
    points = _list_aims(center, ray, height, far)  # (r, 3, n, 3)
    volumes = np.tile(bodies.volume, points[..., 0, 0].size)
    measured = view.measure_behind(points.reshape(-1, 3), volumes).reshape(points.shape[:3])
    before = -half - through_margin
    behind, middle, foot = measured.min(axis=0)  # nan if one of them is
    below = np.minimum(middle, foot)
    least = _compute_least_behind(ray, half, height, sd, through_margin, is_flat_gone)
    is_known = np.maximum(2 * radius, height) >= _LEAST_SIZE
    is_known &= _APART * far <= 2 * radius  # it does not fit between the rays
    is_through = is_known & (behind > least) & (below >= before)
    is_in_front = np.fmin.reduce(measured[0]) < before
    return Traced(is_through, is_in_front, np.fmax.reduce(measured[0]))


def _list_aims(
    center: np.ndarray, ray: np.ndarray, height: np.ndarray, far: np.ndarray
) -> np.ndarray:
    """Return the points of things whose rays are measured, wherever the things may be.

    The upper part is measured: behind it the bearing surface is farther away. Middle and foot must
    not be hidden: a thing that lies along the ray is lower than its box says.

    Args:
        center: of the things, (n, 3).
        ray: directions from the camera to them, (n, 3).
        height: of the things, metres, (n,).
        far: by which they may be elsewhere, metres, (n,).

    Returns:
        Upper part, middle and foot at each of r places, (r, 3, n, 3).
    """
    heights = np.outer((0.25, 0.0, -0.45), height)  # (3, n)
    points = center + heights[..., None] * np.array([0.0, 0.0, 1.0])
    ahead = ray * (1.0, 1.0, 0.0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-9)[:, None]
    left = np.cross((0.0, 0.0, 1.0), ahead)
    offsets = _LEFT[:, None, None] * left - _TOWARDS[:, None, None] * ahead  # (r, n, 3)
    return points + (far[:, None] * offsets)[:, None]


def _compute_least_behind(
    ray: np.ndarray,
    half: np.ndarray,
    height: np.ndarray,
    sd: np.ndarray,
    through_margin: float,
    is_flat_gone: bool,
) -> np.ndarray:
    """Return how far behind the middle of things a ray must go on to have gone through, (n,).

    That is behind the thing, by `through_margin` and the uncertainty of both poses, `sd`. Where
    what bears a thing is nearer behind it than that, it is half of the way from the front of the
    thing to it. Where that is less than the uncertainty, as behind a plate, it is enough that
    nothing was measured in front of it; where that may be the plate itself, it is what would bear
    it. All are in metres, `half` is of the thing along the ray.
    """
    # Where it lay on a surface, a ray through its upper part meets that 3/4 of its height deeper.
    expected = 0.75 * height / np.maximum(-ray[:, 2], 1e-3)
    is_flat = expected < half + through_margin + _SUPPORT
    is_flat |= expected + half < 4 * sd
    least = np.minimum(half + through_margin + 2 * sd, (expected - half) / 2)
    flat = -half - through_margin + 2 * sd
    if not is_flat_gone:
        flat = np.maximum(half, expected) + through_margin + 2 * sd
    return np.where(is_flat, flat, least)

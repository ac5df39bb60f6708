"""Footprints of furniture that are no rectangle: simple polygons, counter-clockwise."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.messages import shorten

Outline = tuple[tuple[float, float], ...]

MOST_CORNERS = 64
_LEAST_AREA = 1e-6  # square metres


def read_outline(name: str, corners: Any) -> Outline:
    """Return the corners of a polygon, counter-clockwise; raises ValueError for any other shape."""
    try:
        num = len(corners)
    except TypeError:
        num = 0
    if not 3 <= num <= MOST_CORNERS:
        raise ValueError(
            f"{name} must have 3 to {MOST_CORNERS} corners, got {shorten(corners)}. Give x, y of "
            "each, around the footprint."
        )
    read = read_numbers(name, corners, (num, 2))
    after = np.roll(read, -1, axis=0)
    area = compute_area(read)
    if abs(area) < _LEAST_AREA or _crosses_itself(read, after):
        raise ValueError(
            f"{name} must have an area and no sides that cross, got {shorten(read.tolist())}. Give "
            "the corners in the order in which they follow each other."
        )
    ordered = read if area > 0 else read[::-1]
    return tuple((float(x), float(y)) for x, y in ordered)


def compute_area(corners: np.ndarray) -> float:
    """Return the area of a polygon (k, 2), below 0 if its corners go clockwise."""
    after = np.roll(corners, -1, axis=0)
    return float(np.sum(corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1])) / 2


def contains_points(outline: Outline, points: np.ndarray) -> np.ndarray:
    """Tell which points (..., 2) are inside, bool (...,)."""
    start, way = _list_sides(outline)
    x, y = points[..., 0, None], points[..., 1, None]
    is_beside = (start[:, 1] > y) != (start[:, 1] + way[:, 1] > y)
    slope = way[:, 0] / np.where(way[:, 1] == 0, 1.0, way[:, 1])
    is_left = x < start[:, 0] + slope * (y - start[:, 1])
    return np.count_nonzero(is_beside & is_left, axis=-1) % 2 == 1


def compute_edge_distance(outline: Outline, points: np.ndarray) -> np.ndarray:
    """Return how far points (..., 2) are from the nearest side, inside and outside, (...,)."""
    start, way = _list_sides(outline)
    offset = points[..., None, :] - start
    share = np.clip((offset * way).sum(axis=-1) / (way * way).sum(axis=-1), 0, 1)
    return np.linalg.norm(offset - share[..., None] * way, axis=-1).min(axis=-1)


def compute_outline_distance(outline: Outline, points: np.ndarray) -> np.ndarray:
    """Return how far points (..., 2) are from the polygon, 0 inside, (...,)."""
    return np.where(contains_points(outline, points), 0.0, compute_edge_distance(outline, points))


def compute_prism_entries(
    outline: Outline, half_height: float, start: np.ndarray, along: np.ndarray
) -> np.ndarray:
    """Return where rays from outside first meet an upright body with this footprint, (n,).

    In lengths of the directions `along` (n, 3) from `start` (3,), inf where a ray passes by. The
    body is around 0, `half_height` in metres.
    """
    first = np.full(len(along), np.inf)
    corner, way = _list_sides(outline)
    with np.errstate(divide="ignore", invalid="ignore"):
        # start + t along = corner + s way, by Cramer's rule.
        det = along[:, None, 1] * way[:, 0] - along[:, None, 0] * way[:, 1]  # (n, k)
        dx, dy = corner[:, 0] - start[0], corner[:, 1] - start[1]
        t = (dy * way[:, 0] - dx * way[:, 1]) / det
        s = (along[:, None, 0] * dy - along[:, None, 1] * dx) / det
        z = start[2] + t * along[:, None, 2]
        meets = (t > 0) & (s >= 0) & (s <= 1) & (np.abs(z) <= half_height)
        first = np.minimum(first, np.where(meets, t, np.inf).min(axis=1))
        for level in (-half_height, half_height):
            t = (level - start[2]) / along[:, 2]
            flat = np.where(np.isfinite(t), t, 0.0)[:, None] * along[:, :2] + start[:2]
            meets = np.isfinite(t) & (t > 0) & contains_points(outline, flat)
            first = np.minimum(first, np.where(meets, t, np.inf))
    return first


def _list_sides(outline: Outline) -> tuple[np.ndarray, np.ndarray]:
    """Return where each side starts and its way to the next corner, (k, 2) each."""
    corner = np.array(outline)
    return corner, np.roll(corner, -1, axis=0) - corner


def _crosses_itself(start: np.ndarray, end: np.ndarray) -> bool:
    """Tell whether two sides that are no neighbours meet."""

    def turn(origin: np.ndarray, other: np.ndarray, point: np.ndarray) -> float:
        ahead, aside = other - origin, point - origin
        return float(ahead[0] * aside[1] - ahead[1] * aside[0])

    for side, other in combinations(range(len(start)), 2):
        if other - side in (1, len(start) - 1):
            continue
        a, b, c, d = start[side], end[side], start[other], end[other]
        sides = turn(a, b, c) * turn(a, b, d), turn(c, d, a) * turn(c, d, b)
        if max(sides) <= 0 and sides != (0.0, 0.0):
            return True
    return False

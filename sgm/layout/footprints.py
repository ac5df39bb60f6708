"""Footprints of boxes: their areas, and how much of them two have in common."""

from __future__ import annotations

import math

import numpy as np

from sgm.layout.box import Box

_LEAST_HIGH = 0.3  # of the lower of two boxes, in which both are at one height


def get_area(box: Box) -> float:
    """Return the area of a footprint, as a rectangle."""
    return box.size[0] * box.size[1]


def compute_shared_area(box: Box, other: Box, num_points: int = 20) -> float:
    """Return the area of the footprint of a box that lies in that of the other one.

    By points of the first, in `num_points` rows of as many.
    """
    steps = (np.arange(num_points) + 0.5) / num_points - 0.5
    flat = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * box.size[:2]
    points = box.to_map(np.column_stack([flat, np.zeros(len(flat))]))
    points[:, 2] = other.center[2]
    return float(other.contains(points).mean()) * get_area(box)


def find_corner_near(box: Box, other: Box, distance: float) -> bool:
    """Tell whether a corner of a footprint is within a distance of the other one, in metres."""
    corners = np.column_stack([box.corners, np.full(len(box.corners), other.center[2])])
    return bool(other.contains(corners, distance).any())


def compute_overlap(box: Box, other: Box) -> tuple[float, float]:
    """Return the area of two footprints that is in both, and that in either, by points.

    0 where one stands above the other.
    """
    apart = math.dist(box.center[:2], other.center[:2])
    whole = get_area(box) + get_area(other)
    high = min(box.top, other.top) - max(box.bottom, other.bottom)
    if apart > box.flat_radius + other.flat_radius or high < _LEAST_HIGH * min(
        box.size[2], other.size[2]
    ):
        return 0.0, whole
    small, large = sorted((box, other), key=get_area)
    both = compute_shared_area(small, large)
    return both, whole - both

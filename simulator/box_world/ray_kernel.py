"""Rays through boxes of matter: depth images, and which points are hidden."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sgm.layout.box import Box
from simulator.kernel import kernel

_NEAR = 0.02  # metres in front of the camera, where nothing is seen
_FLAT = 1e-30  # a direction that stands for 0


class Solids(NamedTuple):
    """B upright boxes of matter, as compiled functions read them.

    Attributes:
        center: x, y, z of the middles, (B, 3).
        half: half of length, width and height, (B, 3).
        turn: cosine and sine of the yaw, (B, 2).
        owner: which thing each belongs to, int32 (B,).
    """

    center: np.ndarray
    half: np.ndarray
    turn: np.ndarray
    owner: np.ndarray

    @classmethod
    def of_boxes(cls, boxes: Sequence[Box], owner: int) -> Solids:
        """Return the boxes of one owner."""
        rows = [[*box.center, *box.size, math.cos(box.yaw), math.sin(box.yaw)] for box in boxes]
        numbers = np.array(rows, dtype=float).reshape(-1, 8)
        return cls(
            center=np.ascontiguousarray(numbers[:, :3]),
            half=np.ascontiguousarray(numbers[:, 3:6] / 2),
            turn=np.ascontiguousarray(numbers[:, 6:]),
            owner=np.full(len(rows), owner, dtype=np.int32),
        )

    @classmethod
    def join(cls, parts: Sequence[Solids]) -> Solids:
        """Return all boxes of some."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    def select_between(self, position: np.ndarray, points: np.ndarray) -> Solids:
        """Return the boxes that may lie between a position (3,) and any of the points (n, 3)."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        reach = np.linalg.norm(points - middle, axis=1).max()
        along, offset = middle - position, self.center - position
        share = np.clip(offset @ along / max(float(along @ along), 1e-12), 0, 1)
        away = np.linalg.norm(offset - share[:, None] * along, axis=1)
        rows = np.flatnonzero(away <= reach + np.linalg.norm(self.half, axis=1))
        return Solids(*(column[rows] for column in self))


@kernel
def cast_rays(
    solids: Solids,
    position: np.ndarray,
    rotation: np.ndarray,
    focal: tuple[float, float],
    middle: tuple[float, float],
    size: tuple[int, int],
    num_things: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw boxes into a depth image.

    Args:
        solids: the boxes.
        position: of the camera, (3,).
        rotation: of the camera, (3, 3).
        focal: fx, fy.
        middle: cx, cy.
        size: rows and columns.
        num_things: the first owners, m.

    Returns:
        z of what each pixel shows, inf for nothing, (rows, columns); whose it is, -1 for nothing,
        int32 (rows, columns); how many pixels the boxes of each of the first owners would take if
        nothing stood before them, (m,).
    """
    center, half, turn, owner = solids
    depth = np.full(size, np.inf)
    seen_owner = np.full(size, -1, dtype=np.int32)
    num_alone = np.zeros(num_things, dtype=np.int64)
    nearest = _find_nearest(solids, position, rotation)
    box_axes, corners = np.empty((3, 3)), np.empty((8, 3))
    for box in np.argsort(nearest):  # most pixels of those behind are settled by then
        hx, hy, hz = half[box, 0], half[box, 1], half[box, 2]
        origin = _turn_camera(center[box], turn[box], position, rotation, box_axes)
        ox, oy, oz = origin
        _place_corners(origin, half[box], box_axes, corners)
        in_rows, in_columns = _frame_corners(corners, focal, middle, size)
        is_counted = owner[box] < num_things
        for row in range(in_rows[0], in_rows[1] + 1):
            v = (row - middle[1]) / focal[1]
            rx = box_axes[0, 1] * v + box_axes[0, 2]
            ry = box_axes[1, 1] * v + box_axes[1, 2]
            rz = box_axes[2, 1] * v + box_axes[2, 2]
            for column in range(in_columns[0], in_columns[1] + 1):
                if not is_counted and depth[row, column] < nearest[box]:
                    continue
                u = (column - middle[0]) / focal[0]
                enter = _enter(
                    ox,
                    oy,
                    oz,
                    box_axes[0, 0] * u + rx,
                    box_axes[1, 0] * u + ry,
                    box_axes[2, 0] * u + rz,
                    hx,
                    hy,
                    hz,
                )
                if enter < _NEAR or enter == math.inf:
                    continue
                if is_counted:
                    num_alone[owner[box]] += 1
                if enter < depth[row, column]:
                    depth[row, column] = enter
                    seen_owner[row, column] = owner[box]
    return depth, seen_owner, num_alone


@kernel
def _find_nearest(solids: Solids, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return how far ahead of the camera each box begins, (B,)."""
    center, half, turn, _ = solids
    nearest = np.empty(len(center))
    for box in range(len(center)):
        cos, sin = turn[box, 0], turn[box, 1]
        ahead = rotation[2, 2] * (center[box, 2] - position[2])
        ahead += rotation[0, 2] * (center[box, 0] - position[0])
        ahead += rotation[1, 2] * (center[box, 1] - position[1])
        reach = abs(cos * rotation[0, 2] + sin * rotation[1, 2]) * half[box, 0]
        reach += abs(cos * rotation[1, 2] - sin * rotation[0, 2]) * half[box, 1]
        nearest[box] = ahead - reach - abs(rotation[2, 2]) * half[box, 2]
    return nearest


@kernel
def _turn_camera(
    center: np.ndarray,
    turn: np.ndarray,
    position: np.ndarray,
    rotation: np.ndarray,
    box_axes: np.ndarray,
) -> tuple[float, float, float]:
    """Compute the camera in the axes of a box, and return where it stands.

    Fills `box_axes` (3, 3) with what a pixel to the right, one down and the direction of view add
    to the direction of a ray, a column each.
    """
    cos, sin = turn[0], turn[1]
    for axis in range(3):
        box_axes[0, axis] = cos * rotation[0, axis] + sin * rotation[1, axis]
        box_axes[1, axis] = cos * rotation[1, axis] - sin * rotation[0, axis]
        box_axes[2, axis] = rotation[2, axis]
    dx, dy = position[0] - center[0], position[1] - center[1]
    return cos * dx + sin * dy, -sin * dx + cos * dy, position[2] - center[2]


@kernel
def _place_corners(
    origin: tuple[float, float, float], half: np.ndarray, box_axes: np.ndarray, corners: np.ndarray
) -> None:
    """Fill `corners` (8, 3) with those of a box: to the right of the camera, down, and ahead."""
    for corner in range(8):
        x = (half[0] if corner & 1 else -half[0]) - origin[0]
        y = (half[1] if corner & 2 else -half[1]) - origin[1]
        z = (half[2] if corner & 4 else -half[2]) - origin[2]
        for axis in range(3):
            corners[corner, axis] = (
                box_axes[0, axis] * x + box_axes[1, axis] * y + box_axes[2, axis] * z
            )


@kernel
def _frame_corners(
    corners: np.ndarray,
    focal: tuple[float, float],
    middle: tuple[float, float],
    size: tuple[int, int],
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first and the last row, and column, in which a box of such corners can be seen."""
    rows, columns = size
    first_row, last_row, first_column, last_column = rows, -1, columns, -1
    for corner in range(8):
        # The corner itself if it is ahead, else where its edges to those ahead come into view.
        for edge in range(4):
            other = corner if edge == 3 else corner ^ (1 << edge)
            if corners[other, 2] < _NEAR or (edge < 3 and corners[corner, 2] >= _NEAR):
                continue
            share = 0.0
            if edge < 3:
                share = (corners[other, 2] - _NEAR) / (corners[other, 2] - corners[corner, 2])
            ahead = max(corners[other, 2] * (1 - share) + corners[corner, 2] * share, 1e-3)
            right = corners[other, 0] * (1 - share) + corners[corner, 0] * share
            down = corners[other, 1] * (1 - share) + corners[corner, 1] * share
            column = right / ahead * focal[0] + middle[0]
            row = down / ahead * focal[1] + middle[1]
            column = min(max(column, -2.0), columns + 1.0)
            row = min(max(row, -2.0), rows + 1.0)
            first_column = min(first_column, math.floor(column))
            last_column = max(last_column, math.ceil(column))
            first_row = min(first_row, math.floor(row))
            last_row = max(last_row, math.ceil(row))
    in_rows = max(first_row, 0), min(last_row, rows - 1)
    return in_rows, (max(first_column, 0), min(last_column, columns - 1))


@kernel
def _enter(
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    hx: float,
    hy: float,
    hz: float,
) -> float:
    """Return where a ray enters a box around 0, in lengths of its direction; inf for nowhere."""
    # A direction along a side is one that is hardly across it: no side is as far as that away.
    dx, dy, dz = 1 / (dx or _FLAT), 1 / (dy or _FLAT), 1 / (dz or _FLAT)
    ax, bx = (-hx - ox) * dx, (hx - ox) * dx
    ay, by = (-hy - oy) * dy, (hy - oy) * dy
    az, bz = (-hz - oz) * dz, (hz - oz) * dz
    low = max(min(ax, bx), min(ay, by), min(az, bz))
    high = min(max(ax, bx), max(ay, by), max(az, bz))
    return low if low <= high and high > 0 else math.inf


@kernel
def find_hidden(solids: Solids, position: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Tell which points (n, 3) a box stands before, or around, seen from (3,); bool (n,)."""
    center, half, turn, _ = solids
    is_hidden = np.zeros(len(points), dtype=np.bool_)
    for box in range(len(center)):
        cos, sin = turn[box, 0], turn[box, 1]
        dx, dy = position[0] - center[box, 0], position[1] - center[box, 1]
        ox, oy = cos * dx + sin * dy, -sin * dx + cos * dy
        oz = position[2] - center[box, 2]
        hx, hy, hz = half[box, 0], half[box, 1], half[box, 2]
        for point in range(len(points)):
            if is_hidden[point]:
                continue
            wx = points[point, 0] - position[0]
            wy = points[point, 1] - position[1]
            wz = points[point, 2] - position[2]
            enter = _enter(ox, oy, oz, cos * wx + sin * wy, cos * wy - sin * wx, wz, hx, hy, hz)
            if enter < 1 - 1e-6:
                is_hidden[point] = True
    return is_hidden

"""Rays through boxes: depth images, and which points are hidden."""

from __future__ import annotations

import math

import numpy as np

from sgm.compiled.kernel import kernel

_NEAR = 0.02  # metres in front of the camera, where nothing is seen


@kernel
def cast_rays(
    center: np.ndarray,
    half: np.ndarray,
    turn: np.ndarray,
    owner: np.ndarray,
    position: np.ndarray,
    rotation: np.ndarray,
    focal: np.ndarray,
    middle: np.ndarray,
    depth: np.ndarray,
    seen_owner: np.ndarray,
    num_alone: np.ndarray,
) -> None:
    """Draw boxes into a depth image.

    Args:
        center: as in `Solids`.
        half: as in `Solids`.
        turn: as in `Solids`.
        owner: as in `Solids`.
        position: of the camera, (3,).
        rotation: of the camera, (3, 3).
        focal: fx, fy.
        middle: cx, cy.
        depth: inf at first; becomes z of what each pixel shows, (rows, columns).
        seen_owner: -1 at first; becomes whose it is, int32 (rows, columns).
        num_alone: 0 at first; becomes how many pixels the boxes of each of the first owners would
            take if nothing stood before them, (m,).
    """
    rows, columns = depth.shape
    # The nearest first: most pixels of those behind are settled by then.
    nearest = np.empty(len(center))
    for box in range(len(center)):
        cos, sin = turn[box, 0], turn[box, 1]
        ahead = rotation[2, 2] * (center[box, 2] - position[2])
        ahead += rotation[0, 2] * (center[box, 0] - position[0])
        ahead += rotation[1, 2] * (center[box, 1] - position[1])
        reach = abs(cos * rotation[0, 2] + sin * rotation[1, 2]) * half[box, 0]
        reach += abs(cos * rotation[1, 2] - sin * rotation[0, 2]) * half[box, 1]
        nearest[box] = ahead - reach - abs(rotation[2, 2]) * half[box, 2]
    for box in np.argsort(nearest):
        cos, sin = turn[box, 0], turn[box, 1]
        # The camera in the axes of the box: an origin and a matrix for directions.
        dx, dy = position[0] - center[box, 0], position[1] - center[box, 1]
        ox, oy = cos * dx + sin * dy, -sin * dx + cos * dy
        oz = position[2] - center[box, 2]
        hx, hy, hz = half[box, 0], half[box, 1], half[box, 2]
        first_row, last_row, first_column, last_column = rows, -1, columns, -1
        is_near = False
        num_behind = 0
        for corner in range(8):
            x = hx if corner & 1 else -hx
            y = hy if corner & 2 else -hy
            z = hz if corner & 4 else -hz
            mx = cos * x - sin * y + center[box, 0] - position[0]
            my = sin * x + cos * y + center[box, 1] - position[1]
            mz = z + center[box, 2] - position[2]
            ahead = rotation[0, 2] * mx + rotation[1, 2] * my + rotation[2, 2] * mz
            if ahead < _NEAR:
                is_near = True
                num_behind += 1
                continue
            right = rotation[0, 0] * mx + rotation[1, 0] * my + rotation[2, 0] * mz
            down = rotation[0, 1] * mx + rotation[1, 1] * my + rotation[2, 1] * mz
            column = right / ahead * focal[0] + middle[0]
            row = down / ahead * focal[1] + middle[1]
            column = min(max(column, -2.0), columns + 1.0)
            row = min(max(row, -2.0), rows + 1.0)
            first_column = min(first_column, math.floor(column))
            last_column = max(last_column, math.ceil(column))
            first_row = min(first_row, math.floor(row))
            last_row = max(last_row, math.ceil(row))
        if num_behind == 8:
            continue
        if is_near:
            first_row, last_row, first_column, last_column = 0, rows - 1, 0, columns - 1
        is_counted = owner[box] < len(num_alone)
        for row in range(max(first_row, 0), min(last_row, rows - 1) + 1):
            for column in range(max(first_column, 0), min(last_column, columns - 1) + 1):
                if not is_counted and depth[row, column] < nearest[box]:
                    continue
                u = (column - middle[0]) / focal[0]
                v = (row - middle[1]) / focal[1]
                wx = rotation[0, 0] * u + rotation[0, 1] * v + rotation[0, 2]
                wy = rotation[1, 0] * u + rotation[1, 1] * v + rotation[1, 2]
                wz = rotation[2, 0] * u + rotation[2, 1] * v + rotation[2, 2]
                enter = _enter(ox, oy, oz, cos * wx + sin * wy, cos * wy - sin * wx, wz, hx, hy, hz)
                if enter < _NEAR or enter == math.inf:
                    continue
                if is_counted:
                    num_alone[owner[box]] += 1
                if enter < depth[row, column]:
                    depth[row, column] = enter
                    seen_owner[row, column] = owner[box]


@kernel
def _enter(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float,
    hx: float, hy: float, hz: float,
) -> float:  # fmt: skip
    """Return where a ray enters a box around 0, in lengths of its direction; inf for nowhere."""
    low, high = -math.inf, math.inf
    for axis in range(3):
        if axis == 0:
            o, d, h = ox, dx, hx
        elif axis == 1:
            o, d, h = oy, dy, hy
        else:
            o, d, h = oz, dz, hz
        if abs(d) < 1e-12:
            if abs(o) > h:
                return math.inf
            continue
        a, b = (-h - o) / d, (h - o) / d
        low = max(low, min(a, b))
        high = min(high, max(a, b))
    return low if low <= high and high > 0 else math.inf


@kernel
def find_hidden(
    center: np.ndarray,
    half: np.ndarray,
    turn: np.ndarray,
    owner: np.ndarray,
    position: np.ndarray,
    points: np.ndarray,
    ignored: np.ndarray,
    is_hidden: np.ndarray,
) -> None:
    """Tell which points a box stands before, or around.

    Args:
        center: as in `Solids`.
        half: as in `Solids`.
        turn: as in `Solids`.
        owner: as in `Solids`.
        position: of the camera, (3,).
        points: (n, 3).
        ignored: owner whose boxes hide each point not, -1 for none, (n,).
        is_hidden: False at first, bool (n,).
    """
    for box in range(len(center)):
        cos, sin = turn[box, 0], turn[box, 1]
        dx, dy = position[0] - center[box, 0], position[1] - center[box, 1]
        ox, oy = cos * dx + sin * dy, -sin * dx + cos * dy
        oz = position[2] - center[box, 2]
        hx, hy, hz = half[box, 0], half[box, 1], half[box, 2]
        for point in range(len(points)):
            if is_hidden[point] or owner[box] == ignored[point]:
                continue
            wx = points[point, 0] - position[0]
            wy = points[point, 1] - position[1]
            wz = points[point, 2] - position[2]
            enter = _enter(ox, oy, oz, cos * wx + sin * wy, cos * wy - sin * wx, wz, hx, hy, hz)
            if enter < 1 - 1e-6:
                is_hidden[point] = True

"""The cells of space that detections of one piece of furniture have shown, and the box of them."""

from __future__ import annotations

import math

import numpy as np

from sgm.layout.box import Box
from sgm.layout.turns import make_turn

CELL = 0.06  # metres, of a side
_OFFSET = 1 << 20  # of the numbers of cells along an axis, so that none is negative
_LEAST_SHARE = 0.7  # of the frames that show a cell, and of one more, that show it within
_LEAST_CELLS = 10
_TURNS = np.deg2rad(np.arange(0.0, 90.0, 3.0))
_TURN_GAIN = 0.93  # of the area at yaw 0, below which another yaw is believed
_TRIM = 0.015  # share of the cells beyond each side: depth at edges is that of what is behind
_LEAST_SLICE = 0.15  # of the mean slice of cells along a side: what holds less is no part of it
_LEAST_SIDE = 0.1  # metres
_WIDENING = 0.02  # metres by which noise of depth and boxes widens every side
_STANDS = 0.35  # metres of free height below which furniture stands on the floor
_FLAT = 0.3  # metres from front to back: of what is higher than the camera, the rest was hidden
_USUAL_DEPTH = 0.5  # metres from front to back where neither it nor the wall was seen
_DEEPEST = 0.9  # metres from the front to a wall that is that behind the furniture
_BESIDE = 0.5  # metres beside furniture within which its wall is looked for


class FurnitureCells:
    """Counts for cells of space how often a detection has shown them, or passed them by.

    A detection of furniture has a box in pixels; what is measured within it is the furniture, or
    what is behind it. Other frames tell one from the other: a cell that is beside the box of the
    detection in most of them is not of the furniture.
    """

    def __init__(self) -> None:
        self._keys = np.empty(0, dtype=np.int64)
        self._counts = np.empty((0, 5))  # within, beside, and sums of x, y, z
        self._new: list[tuple[np.ndarray, np.ndarray]] = []

    def add(self, points: np.ndarray, is_within: np.ndarray) -> None:
        """Count the cells of points (n, 3) in the map, within the detection or not, of a frame."""
        keys = _number_cells(points)
        known, row = np.unique(keys, return_inverse=True)
        num_within = np.bincount(row, is_within)
        counts = np.empty((len(known), 5))
        counts[:, 0] = num_within > 0
        counts[:, 1] = num_within == 0
        counts[row, 2:] = points  # the last one in each cell
        self._new.append((known, counts))

    def join(self, other: FurnitureCells) -> None:
        """Take in all that was counted for the same furniture."""
        other._sum()
        self._new.append((other._keys, other._counts))

    def move(self, turn: np.ndarray, shift: np.ndarray) -> None:
        """Turn all cells by a rotation (3, 3) around the origin of the map, and shift them (3,)."""
        self._sum()
        total = self._counts[:, :2].sum(axis=1, keepdims=True)
        counts = self._counts.copy()
        counts[:, 2:] = self._counts[:, 2:] @ turn.T + total * shift
        self._keys, self._counts = np.empty(0, dtype=np.int64), np.empty((0, 5))
        self._new.append((_number_cells(counts[:, 2:] / np.maximum(total, 1)), counts))

    def _sum(self) -> None:
        if not self._new:
            return
        keys = np.concatenate([self._keys, *(keys for keys, _ in self._new)])
        counts = np.concatenate([self._counts, *(counts for _, counts in self._new)])
        self._new.clear()
        self._keys, row = np.unique(keys, return_inverse=True)
        self._counts = _sum_rows(row, counts, len(self._keys))

    def fit(self, eye: np.ndarray, ground: float, sd: float = 0.0) -> Box | None:
        """Return the box of the furniture; None if too little was seen.

        Its front looks to where it was seen from, its sides are as turned as makes it smallest.

        Args:
            eye: mean position of the camera in the map, (3,).
            ground: height of the floor.
            sd: standard deviation of the poses, metres: by so much it looks wider on every side.
        """
        self._sum()
        within, beside = self._counts[:, 0], self._counts[:, 1]
        total = within + beside
        middle = self._counts[:, 2:] / np.maximum(total, 1)[:, None]
        # Of the first frames every cell counts that they show, later one more must have.
        doubt = min(max(float(within.max(initial=0.0)) - 1, 0) / 4, 1.0)
        is_own = (within > 0) & (within >= _LEAST_SHARE * (total + doubt))
        if is_own.sum() < _LEAST_CELLS:
            return None
        body, surroundings = middle[is_own], middle[~is_own & (beside >= within)]
        yaw = _find_yaw(body[:, :2], eye[:2])
        axes = make_turn(yaw)
        flat = body[:, :2] @ axes
        widening = _WIDENING + sd
        low, high = (_narrow(_find_range(flat[:, side]), widening) for side in (0, 1))
        bottom, top = _find_heights(body[:, 2], ground)
        if low[1] - low[0] < _FLAT and top > eye[2] - 0.1:
            low = _find_back(low, high, surroundings, axes, ground), low[1]
        x, y = axes @ (sum(low) / 2, sum(high) / 2)
        size = low[1] - low[0], high[1] - high[0], top - bottom
        length, width = (max(float(side), _LEAST_SIDE) for side in size[:2])
        height = max(size[2], 0.03)
        return Box((float(x), float(y), top - height / 2), (length, width, height), yaw)


def _sum_rows(row: np.ndarray, values: np.ndarray, num_rows: int) -> np.ndarray:
    """Return the sums of values (n, 5) over those of each row (n,), (num_rows, 5)."""
    return np.column_stack([np.bincount(row, column, num_rows) for column in values.T])


def _number_cells(points: np.ndarray) -> np.ndarray:
    """Return one number for the cell of each point (n, 3), (n,)."""
    x, y, z = np.clip(np.floor(points / CELL).astype(np.int64) + _OFFSET, 0, 2 * _OFFSET - 1).T
    return np.asarray((x * 2 * _OFFSET + y) * 2 * _OFFSET + z)


def _find_yaw(flat: np.ndarray, eye: np.ndarray) -> float:
    """Return the yaw of the smallest rectangle around points (n, 2) whose front looks to the eye.

    Walls and what stands along them follow the axes of most maps: another yaw must be smaller.
    """
    turned = flat @ make_turn(_TURNS)  # (turns, n, 2)
    ends = np.quantile(turned, [_TRIM, 1 - _TRIM], axis=1)  # (2, turns, 2)
    area = np.prod(ends[1] - ends[0], axis=1)
    best = int(area.argmin())
    turn = float(_TURNS[best]) if area[best] < _TURN_GAIN * area[0] else 0.0
    away = eye - flat.mean(axis=0)
    bearing = math.atan2(away[1], away[0])
    quarter = round((bearing - turn) / (math.pi / 2))
    yaw = turn + quarter * math.pi / 2
    return math.atan2(math.sin(yaw), math.cos(yaw))


def _find_range(values: np.ndarray) -> tuple[float, float]:
    """Return where values begin and end, without slices at the ends that hold next to nothing."""
    first = math.floor(float(values.min()) / CELL)
    slices = np.floor(values / CELL).astype(np.int64) - first
    counts = np.bincount(slices)
    begin, end = 0, len(counts)
    while end - begin > 1:
        least = _LEAST_SLICE * counts[begin:end].mean()
        if counts[begin] < least:
            begin += 1
        elif counts[end - 1] < least:
            end -= 1
        else:
            break
    kept = values[(slices >= begin) & (slices < end)]
    return float(kept.min()), float(kept.max())


def _narrow(ends: tuple[float, float], widening: float) -> tuple[float, float]:
    """Return a range without what errors have added at both ends, half of it at most."""
    less = min(widening, (ends[1] - ends[0]) / 4)
    return ends[0] + less, ends[1] - less


def _find_heights(z: np.ndarray, ground: float) -> tuple[float, float]:
    """Return the lower and the upper side of furniture by the heights of its cells (n,)."""
    ordered = np.sort(z)
    most = max(3, len(z) // 25)  # so many cells are its uppermost, rather than things on it
    near = z[z > ordered[-most] - CELL / 2]
    top = float(np.median(near)) if len(near) > len(z) // 4 else float(ordered[-most])
    low = float(np.quantile(z, 0.02))
    return (ground if low < ground + _STANDS else low - CELL / 2), max(top, ground + 0.05)


def _find_back(
    low: tuple[float, float],
    high: tuple[float, float],
    surroundings: np.ndarray,
    axes: np.ndarray,
    ground: float,
) -> float:
    """Return where furniture ends behind whose upper side is too high to be seen.

    That is the wall behind it, where one was measured beside or above it, else the usual depth.
    """
    flat = surroundings[:, :2] @ axes
    is_near = (flat[:, 1] > high[0] - _BESIDE) & (flat[:, 1] < high[1] + _BESIDE)
    is_near &= (flat[:, 0] < low[1] - 0.1) & (flat[:, 0] > low[1] - _DEEPEST)
    behind = flat[is_near & (surroundings[:, 2] > ground + 0.1), 0]
    if len(behind) < _LEAST_CELLS:
        return min(low[0], low[1] - _USUAL_DEPTH)
    counts, edges = np.histogram(behind, bins=np.arange(low[1] - _DEEPEST, low[1], CELL))
    wall = int(counts.argmax())
    return min(low[0], float(edges[wall + 1]))

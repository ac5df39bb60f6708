"""Boxes as many frames see them: how much of what was seen they explain, and would if moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.camera.silhouettes import AT, ENDS, LENS, SEEN
from sgm.layout.box import Box
from sgm.layout.turns import make_turn

_NEAREST = 0.1  # metres before the camera: what is nearer is beyond the image
# The two axes along the sides that a box has towards each axis.
_FIRST, _SECOND = np.array([1, 0, 0]), np.array([2, 2, 1])
# Moves of the sides of a box, each out and in: the axis of the side, whether it is the high one,
# and which way it moves.
_SIDES = [(0, 0), (0, 1), (1, 0), (1, 1), (2, 1), (2, 0)]
AXIS, IS_HIGH = np.array(_SIDES).repeat(2, axis=0).T  # (12,)
SIGN = np.tile([1.0, -1.0], len(_SIDES))
# Of 18 sides, as `_project` has them: those that a move makes, and those that stay. The last pair
# is of the box as it is.
_MADE = np.append(6 * AXIS + 3 * IS_HIGH + 1 + np.arange(12) % 2, 0)
_KEPT = np.append(6 * AXIS + 3 * (1 - IS_HIGH), 3)


class BoxViews:
    """Boxes, and for each of them the frames that it is seen from.

    Attributes:
        low, high: corners in the own axes of each box, from the origin of the map, (k, 3).
    """

    def __init__(self, frames: np.ndarray, num_seen: np.ndarray, boxes: Sequence[Box]) -> None:
        """Take k boxes, and v rows of `Silhouettes` for each, (k, v, 20).

        The first of them are of frames, as many as (k,) says; the others are 0.
        """
        self._num_seen = num_seen
        turn = make_turn(np.array([box.yaw for box in boxes]))
        center = np.array([box.center for box in boxes])
        half = np.array([box.size for box in boxes]) / 2
        center[:, :2] = np.einsum("ka,kab->kb", center[:, :2], turn)
        self.low, self.high = center - half, center + half
        parts = np.ascontiguousarray(frames.transpose(2, 0, 1))  # (20, k, v)
        self._origin, self._ends, self._seen = parts[AT], parts[ENDS], parts[SEEN]
        axes = parts[LENS].reshape(3, 3, *frames.shape[:2])  # of the map, then of the camera
        axes[:2] = np.einsum("kab,ackv->bckv", turn, axes[:2])
        self._axes = np.ascontiguousarray(axes.swapaxes(0, 1))  # of the camera, then of the box
        self._area = np.prod(self._seen[2:] - self._seen[:2], axis=0)

    def keep(self, kept: np.ndarray) -> None:
        """Go on with some of the boxes, (k,)."""
        self.low, self.high, self._num_seen = self.low[kept], self.high[kept], self._num_seen[kept]
        self._axes, self._area = self._axes[:, :, kept], self._area[kept]
        self._origin, self._ends, self._seen = (
            part[:, kept] for part in (self._origin, self._ends, self._seen)
        )

    def move(
        self, rows: np.ndarray, axis: np.ndarray, is_high: np.ndarray, shift: np.ndarray
    ) -> None:
        """Shift a side of some boxes, (r,) each."""
        ends = np.stack([self.low, self.high])
        ends[is_high, rows, axis] += shift
        self.low, self.high = ends

    def score(self) -> np.ndarray:
        """Return the mean overlap of the boxes, (k,)."""
        first, last = self._project(np.zeros((1, len(self.low))), axes=1)
        both = self._compare(first.min(axis=1, keepdims=True), last.max(axis=1, keepdims=True))
        return both[0]

    def score_moves(self, step: np.ndarray) -> np.ndarray:
        """Return the mean overlap of all 12 moves by a step (k,), and of the boxes, (13, k)."""
        first, last = self._project(np.stack([np.zeros(len(step)), step, -step]), axes=3)
        return self._compare(
            np.minimum(first[:, _MADE], first[:, _KEPT]), np.maximum(last[:, _MADE], last[:, _KEPT])
        )

    def _project(self, shifts: np.ndarray, axes: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the pixels where shifted sides of boxes begin and end.

        Args:
            shifts: s of them, metres along the axis of the side, (s, k).
            axes: those of the sides: 1 for the first one alone, or 3.

        Returns:
            Columns and rows in each frame, (2, axes * 2 * s, k, v) each. Sides are ordered by axis,
            low ones first.
        """
        ends = np.stack([self.low, self.high], axis=0).transpose(2, 0, 1)  # (3, 2, k)
        corner = self._axes[:, :, None] * ends[..., None]  # (3, 3, 2, k, v)
        flat = (
            corner[:, _FIRST[:axes], None] + corner[:, _SECOND[:axes], :, None]
        )  # (3, axes, 2, 2, k, v)
        flat -= self._origin[:, None, None, None]
        flat = flat.reshape(3, axes, 4, *flat.shape[-2:]).swapaxes(1, 2)
        coordinate = (ends[:axes, :, None] + shifts).reshape(axes, -1, len(self.low))
        side = self._axes[:, :axes, None] * coordinate[..., None]  # (3, axes, 2 s, k, v)
        camera = flat[:, :, :, None] + side[:, None]  # (3, 4, axes, 2 s, k, v)
        pixels = camera[:2] / np.maximum(camera[2], _NEAREST)
        pixels = pixels.reshape(2, 4, -1, *pixels.shape[-2:])
        return pixels.min(axis=1), pixels.max(axis=1)

    def _compare(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the mean overlap of boxes between pixels (2, m, k, v) with those seen, (m, k)."""
        low, high = self._ends[:2, None], self._ends[2:, None]
        first = np.minimum(np.maximum(first, low), high)
        last = np.minimum(np.maximum(last, low), high)
        both = np.minimum(last, self._seen[2:, None]) - np.maximum(first, self._seen[:2, None])
        both = np.maximum(both, 0)
        shared = both[0] * both[1]
        side = last - first
        whole = side[0] * side[1] + self._area - shared
        total: np.ndarray = (shared / np.maximum(whole, 1e-9)).sum(axis=-1)
        return total / self._num_seen

"""How well a box explains what a detector said in many frames: boxes in pixels around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.layout.box import Box

_MOST = 24  # frames that are kept
_STEPS = (0.2, 0.1, 0.05, 0.025)  # metres by which sides are moved, the coarse ones first
_LEAST_GAIN = 1e-3  # of the mean overlap
_LEAST_SIDE = 0.08  # metres
_NEAREST = 0.1  # metres before the camera: what is nearer is beyond the image
_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
# Sides by which a box may be moved, in the order in which they are tried, each out and in: of the
# low and of the high corner, along x, y and z.
_MOVED = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [1, 2], [0, 2]]).repeat(2, axis=0)
_LOW_MOVES, _HIGH_MOVES = np.zeros((2, len(_MOVED), 3))
for _row, (_is_high, _side) in enumerate(_MOVED.tolist()):
    (_HIGH_MOVES if _is_high else _LOW_MOVES)[_row, _side] = 1 - 2 * (_row % 2)


class Silhouettes:
    """Boxes in pixels of one piece of furniture, over frames from many sides.

    Of many frames, 24 are kept, evenly over all of them.
    """

    def __init__(self) -> None:
        self._num_seen, self._stride = 0, 1
        self._rows: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []

    def add(self, view: CameraView, box: tuple[float, float, float, float]) -> None:
        """Note the box in pixels of a frame."""
        if self._num_seen % self._stride == 0:
            camera = view.intrinsics
            lens = np.array([camera.fx, camera.fy, camera.cx, camera.cy, camera.width,
                             camera.height])  # fmt: skip
            pose = view.pose
            self._rows.append((pose.rotation, pose.position, lens, np.array(box)))
            if len(self._rows) > _MOST:
                self._rows = self._rows[::2]
                self._stride *= 2
        self._num_seen += 1

    def join(self, other: Silhouettes) -> None:
        """Take in those of the same furniture."""
        self._rows += other._rows
        self._num_seen += other._num_seen
        while len(self._rows) > _MOST:
            self._rows = self._rows[::2]
            self._stride *= 2

    def move(self, turn: np.ndarray, shift: np.ndarray) -> None:
        """Turn the cameras by a rotation (3, 3) around the origin, and shift them (3,)."""
        self._rows = [
            (turn @ rotation, turn @ position + shift, lens, seen)
            for rotation, position, lens, seen in self._rows
        ]

    def compute_overlap(self, box: Box) -> float:
        """Return the mean overlap of a box with what was seen, 0 to 1; 1 where nothing was."""
        if not self._rows:
            return 1.0
        low, high = _get_ends(box)
        return float(_Views(self._rows, box.yaw).score(low[None], high[None])[0])

    def fit(self, box: Box, ground: float) -> Box:
        """Return the box with its sides moved so that it explains best what was seen.

        No side is moved below the floor, whose height is `ground`.
        """
        if not self._rows:
            return box
        views = _Views(self._rows, box.yaw)
        low, high = _get_ends(box)
        lowest = min(ground, float(low[2])) - 1e-9
        best = float(views.score(low[None], high[None])[0])
        for step in _STEPS:
            for _ in range(3):
                has_moved, done = False, 0
                while done < len(_LOW_MOVES):
                    lows, highs = low + step * _LOW_MOVES[done:], high + step * _HIGH_MOVES[done:]
                    scores = views.score(lows, highs)
                    is_box = (highs - lows).min(axis=1) >= _LEAST_SIDE
                    is_better = is_box & (lows[:, 2] >= lowest) & (scores > best + _LEAST_GAIN)
                    if not is_better.any():
                        break
                    first = int(is_better.argmax())
                    low, high, best = lows[first], highs[first], float(scores[first])
                    done += first // 2 * 2 + 2  # with the next side
                    has_moved = True
                if not has_moved:
                    break
        middle = (low + high) / 2
        center = (*(_get_axes(box.yaw) @ middle[:2]).tolist(), float(middle[2]))
        return replace(box, center=center, size=tuple((high - low).tolist()))


class _Views:
    """Frames from which boxes of one yaw are seen, all their sides along the same axes."""

    def __init__(
        self, rows: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]], yaw: float
    ) -> None:
        rotation, position, lens, self._seen = (np.array(part) for part in zip(*rows, strict=True))
        axes = np.eye(3)
        axes[:2, :2] = _get_axes(yaw)
        self._axes = np.einsum("ab,vac->bvc", axes, rotation)  # of the box, in the camera (3, v, 3)
        self._origin = np.einsum("va,vac->vc", position, rotation)
        self._focal, self._middle, self._size = lens[:, :2], lens[:, 2:4], lens[:, 4:6] - 0.5

    def score(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return the mean overlap of boxes between corners (m, 3) with what was seen, (m,)."""
        ends = np.stack([low, high], axis=1)[..., None, None]  # (m, 2, 3, 1, 1)
        x, y, z = (ends[:, :, side] * self._axes[side] for side in range(3))  # (m, 2, v, 3)
        z = z - self._origin
        camera = x[:, :, None, None] + y[:, None, :, None] + z[:, None, None]
        camera = camera.reshape(len(low), 8, len(self._seen), 3)
        away = np.maximum(camera[..., 2:], _NEAREST)
        pixels = camera[..., :2] / away * self._focal + self._middle
        first = np.minimum(np.maximum(pixels.min(axis=1), -0.5), self._size)
        last = np.minimum(np.maximum(pixels.max(axis=1), -0.5), self._size)
        scores: np.ndarray = np.mean(_compare(first, last, self._seen), axis=1)
        return scores


def compute_overlaps(view: CameraView, boxes: Sequence[Box], seen: np.ndarray) -> np.ndarray:
    """Return the overlap of each of k boxes with a box in pixels (k, 4) of a frame, (k,)."""
    camera, pose = view.intrinsics, view.pose
    half = np.array([box.size for box in boxes])[:, None] / 2
    own = _SIGNS * half  # (k, 8, 3)
    yaw = np.array([box.yaw for box in boxes])[:, None]
    cos, sin = np.cos(yaw), np.sin(yaw)
    x = cos * own[..., 0] - sin * own[..., 1]
    y = sin * own[..., 0] + cos * own[..., 1]
    corners = np.stack([x, y, own[..., 2]], axis=-1) + np.array([b.center for b in boxes])[:, None]
    at = (corners - pose.position) @ pose.rotation
    pixels = at[..., :2] / np.maximum(at[..., 2:], _NEAREST)
    pixels = pixels * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    size = np.array([camera.width, camera.height]) - 0.5
    first, last = (np.clip(ends, -0.5, size) for ends in (pixels.min(axis=1), pixels.max(axis=1)))
    return _compare(first, last, seen)


def _compare(first: np.ndarray, last: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return intersection over union of boxes between corners (..., 2) and boxes (..., 4)."""
    both = np.maximum(np.minimum(last, seen[..., 2:]) - np.maximum(first, seen[..., :2]), 0)
    shared = both[..., 0] * both[..., 1]
    side, own = last - first, seen[..., 2:] - seen[..., :2]
    whole = side[..., 0] * side[..., 1] + own[..., 0] * own[..., 1] - shared
    overlap: np.ndarray = shared / np.maximum(whole, 1e-9)
    return overlap


def _get_axes(yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]])


def _get_ends(box: Box) -> tuple[np.ndarray, np.ndarray]:
    """Return the low and the high corner in the own axes of a box, from the origin of the map."""
    flat = np.array(box.center[:2]) @ _get_axes(box.yaw)
    middle = np.array([*flat, box.center[2]])
    return middle - np.array(box.size) / 2, middle + np.array(box.size) / 2

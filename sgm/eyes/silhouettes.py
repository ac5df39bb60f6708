"""How well a box explains what a detector said in many frames: boxes in pixels around it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.layout.box import Box

_MOST = 24  # frames that are kept
_STEPS = (0.2, 0.1, 0.05, 0.025)  # metres by which sides are moved, the coarse ones first
_LEAST_GAIN = 1e-3  # of the mean overlap
_LEAST_SIDE = 0.08  # metres
_NEAREST = 0.1  # metres before the camera: what is nearer is beyond the image
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


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

    def compute_overlap(self, box: Box) -> float:
        """Return the mean overlap of a box with what was seen, 0 to 1; 1 where nothing was."""
        if not self._rows:
            return 1.0
        low, high = _get_ends(box)
        return float(self._score(low, high, _get_axes(box.yaw), self._stack()))

    def fit(self, box: Box, ground: float = -np.inf) -> Box:
        """Return the box with its sides moved so that it explains best what was seen.

        None lies below the height `ground` of the floor.
        """
        if not self._rows:
            return box
        axes, stacked = _get_axes(box.yaw), self._stack()
        low, high = _get_ends(box)
        lowest = min(ground, float(low[2])) - 1e-9
        best = self._score(low, high, axes, stacked)
        for step in _STEPS:
            for _ in range(3):
                has_moved = False
                for ends, side in ((low, 0), (high, 0), (low, 1), (high, 1), (high, 2), (low, 2)):
                    for move in (step, -step):
                        ends[side] += move
                        score = -1.0
                        if high[side] - low[side] >= _LEAST_SIDE and low[2] >= lowest:
                            score = self._score(low, high, axes, stacked)
                        if score > best + _LEAST_GAIN:
                            best, has_moved = score, True
                            break
                        ends[side] -= move
                if not has_moved:
                    break
        middle = (low + high) / 2
        center = (*(axes @ middle[:2]).tolist(), float(middle[2]))
        size = high - low
        return replace(box, center=center, size=tuple(size.tolist()))

    def _stack(self) -> tuple[np.ndarray, ...]:
        return tuple(np.array(column) for column in zip(*self._rows, strict=True))

    @staticmethod
    def _score(
        low: np.ndarray, high: np.ndarray, axes: np.ndarray, stacked: tuple[np.ndarray, ...]
    ) -> float:
        rotation, position, lens, seen = stacked
        own = low + _CORNERS * (high - low)
        corners = np.column_stack([own[:, :2] @ axes.T, own[:, 2]])
        camera = np.einsum("vci,vij->vcj", corners[None] - position[:, None], rotation)
        away = np.maximum(camera[..., 2:], _NEAREST)
        pixels = camera[..., :2] / away * lens[:, None, :2] + lens[:, None, 2:4]
        size = lens[:, 4:6] - 0.5
        first = np.clip(pixels.min(axis=1), -0.5, size)
        last = np.clip(pixels.max(axis=1), -0.5, size)
        both = np.minimum(last, seen[:, 2:]) - np.maximum(first, seen[:, :2])
        shared = np.prod(np.maximum(both, 0), axis=1)
        whole = np.prod(last - first, axis=1) + np.prod(seen[:, 2:] - seen[:, :2], axis=1) - shared
        return float(np.mean(shared / np.maximum(whole, 1e-9)))


def _get_axes(yaw: float) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]])


def _get_ends(box: Box) -> tuple[np.ndarray, np.ndarray]:
    """Return the low and the high corner in the own axes of a box, from the origin of the map."""
    flat = np.array(box.center[:2]) @ _get_axes(box.yaw)
    middle = np.array([*flat, box.center[2]])
    return middle - np.array(box.size) / 2, middle + np.array(box.size) / 2

"""Boxes in pixels of one piece of furniture: what a detector said in many frames."""

from __future__ import annotations

import numpy as np

from sgm.camera.camera_view import CameraView

_MOST = 24  # frames that are kept
# Of the numbers that are kept of a frame: the axes of the camera in the map, times its focal
# lengths; its position along them; then the ends of the image, and the box, from the optical axis.
LENS, AT, ENDS, SEEN = slice(0, 9), slice(9, 12), slice(12, 16), slice(16, 20)


class Silhouettes:
    """Boxes in pixels of one piece of furniture, over frames from many sides.

    Of many frames, 24 are kept, evenly over all of them.
    """

    def __init__(self) -> None:
        self._num_seen, self._stride = 0, 1
        self._frames: list[np.ndarray] = []

    def add(self, view: CameraView, box: tuple[float, float, float, float]) -> None:
        """Note the box in pixels of a frame."""
        if self._num_seen % self._stride == 0:
            self._frames.append(make_row(view, np.array(box)))
            if len(self._frames) > _MOST:
                self._frames = self._frames[::2]
                self._stride *= 2
        self._num_seen += 1

    def join(self, other: Silhouettes) -> None:
        """Take in those of the same furniture."""
        self._frames += other._frames
        self._num_seen += other._num_seen
        while len(self._frames) > _MOST:
            self._frames = self._frames[::2]
            self._stride *= 2

    def move(self, turn: np.ndarray, shift: np.ndarray) -> None:
        """Turn the cameras by a rotation (3, 3) around the origin, and shift them (3,)."""
        for number, frame in enumerate(self._frames):
            axes = turn @ frame[LENS].reshape(3, 3)
            origin = frame[AT] + shift @ axes
            self._frames[number] = np.concatenate([axes.ravel(), origin, frame[ENDS], frame[SEEN]])

    def __len__(self) -> int:
        """Return the number of frames that are kept."""
        return len(self._frames)

    def fill(self, frames: np.ndarray) -> None:
        """Write what is kept of each frame into the first of some rows (v, 20)."""
        frames[: len(self._frames)] = self._frames


def make_row(view: CameraView, box: np.ndarray) -> np.ndarray:
    """Return what is kept of a frame with boxes in pixels (..., 4), (..., 20)."""
    camera, pose = view.intrinsics, view.pose
    axes = pose.rotation * (camera.fx, camera.fy, 1.0)
    middle = np.array([camera.cx, camera.cy, camera.cx, camera.cy])
    ends = np.array([-0.5, -0.5, camera.width - 0.5, camera.height - 0.5]) - middle
    kept = np.empty((*box.shape[:-1], 20))
    kept[..., LENS], kept[..., AT], kept[..., ENDS] = axes.ravel(), pose.position @ axes, ends
    kept[..., SEEN] = box - middle
    return kept

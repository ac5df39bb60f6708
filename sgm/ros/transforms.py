"""Where frames of coordinates are in each other, over time: what tf2 publishes."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from operator import itemgetter

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.camera.pinhole import make_rotation
from sgm.messages import shorten

_MOST_FRAMES = 1000  # of coordinates, by far more than robots have
_MOST_LEVELS = 64  # of frames in frames
_MOST_KEPT = 4000  # transforms of one frame over time


class TransformTree:
    """A tree of frames, each with its transforms to its parent over the last seconds.

    Between two transforms the position is interpolated, and the turn, too. After the last one the
    last one holds: how old it is is said, and up to the caller.
    """

    def __init__(self, keeps: float = 10.0) -> None:
        """Start without frames; transforms are kept for some seconds."""
        self._keeps = keeps
        self._parent: dict[str, str] = {}
        self._still: dict[str, np.ndarray] = {}
        self._kept: dict[str, deque[tuple[float, np.ndarray]]] = {}

    def add(
        self,
        parent: str,
        child: str,
        time: float,
        position: Sequence[float] | np.ndarray,
        quaternion: Sequence[float] | np.ndarray,
        *,
        is_still: bool = False,
    ) -> None:
        """Add where `child` is in `parent`: x, y, z and x, y, z, w; `is_still` if it never changes.

        Raises:
            ValueError: if a number is not finite, the quaternion is no turn, or there are too many
                frames.
        """
        parent, child = parent.lstrip("/"), child.lstrip("/")
        pose = np.append(
            read_numbers("position of a transform", position, (3,)),
            read_numbers("quaternion of a transform", quaternion, (4,)),
        )
        norm = float(np.linalg.norm(pose[3:]))
        if abs(norm - 1) > 0.01:
            raise ValueError(
                f"quaternion of a transform must have the length 1, got {norm:.3g} from "
                f"{shorten(parent)} to {shorten(child)}. Give x, y, z, w."
            )
        pose[3:] /= norm
        if child not in self._parent and len(self._parent) >= _MOST_FRAMES:
            raise ValueError(
                f"frames must be at most {_MOST_FRAMES}, got one more, {shorten(child)}. Leave out "
                "what is no part of the robot."
            )
        self._parent[child] = parent
        if is_still:
            self._still[child] = pose
            return
        kept = self._kept.setdefault(child, deque(maxlen=_MOST_KEPT))
        if kept and time <= kept[-1][0]:
            if time > kept[-1][0] - self._keeps:
                return  # a late one; those around it are there
            kept.clear()  # the clock was set back
        kept.append((time, pose))
        while kept[0][0] < time - self._keeps:
            kept.popleft()

    def list_frames(self) -> list[str]:
        """Return the names of all frames, those that others are in first."""
        return [*dict.fromkeys((*self._parent.values(), *self._parent))]

    def find(self, target: str, source: str, time: float) -> tuple[np.ndarray, float] | None:
        """Return the pose of the frame `source` in the coordinates of `target`.

        Returns:
            A matrix (4, 4), and the time of the oldest transform on the way that had to stand for a
            later time, `time` where none had to; None if the frames are not connected, or were not
            known so early.
        """
        up = self._climb(source.lstrip("/"), time)
        down = self._climb(target.lstrip("/"), time)
        for frame, (matrix, known) in up.items():
            if frame in down:
                to_frame, also = down[frame]
                return np.linalg.inv(to_frame) @ matrix, min(known, also)
        return None

    def _climb(self, frame: str, time: float) -> dict[str, tuple[np.ndarray, float]]:
        """Return the pose of a frame in each frame above it, and since when it is known."""
        matrix, known = np.eye(4), time
        found = {frame: (matrix, known)}
        while frame in self._parent and len(found) < _MOST_LEVELS:
            step = self._read(frame, time)
            if step is None:
                break
            matrix, known = step[0] @ matrix, min(known, step[1])
            frame = self._parent[frame]
            if frame in found:
                break
            found[frame] = matrix, known
        return found

    def _read(self, child: str, time: float) -> tuple[np.ndarray, float] | None:
        """Return where a frame is in its parent, and the time of that; None before the first."""
        if child in self._still:
            return make_matrix(self._still[child]), time
        kept = self._kept[child]
        after = bisect_right(kept, time, key=itemgetter(0))
        if after == 0:
            return None
        since, before = kept[after - 1]
        if after == len(kept):
            return make_matrix(before), min(since, time)
        until, behind = kept[after]
        return make_matrix(_mix(before, behind, (time - since) / (until - since))), time


def make_matrix(pose: np.ndarray) -> np.ndarray:
    """Return the matrix (4, 4) of x, y, z and a quaternion x, y, z, w of length 1, (7,)."""
    matrix = np.eye(4)
    matrix[:3, :3] = make_rotation(pose[3:])
    matrix[:3, 3] = pose[:3]
    return matrix


def _mix(pose: np.ndarray, other: np.ndarray, share: float) -> np.ndarray:
    """Return the pose between two, (7,): positions on a line, quaternions by their mean."""
    if pose[3:] @ other[3:] < 0:  # of two that mean the same turn, the nearer one
        other = np.append(other[:3], -other[3:])
    mixed = (1 - share) * pose + share * other
    mixed[3:] /= np.linalg.norm(mixed[3:])
    return mixed

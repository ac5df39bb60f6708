"""Which points of a place were in view over the frames of a visit, and its coverage by them."""

from __future__ import annotations

import numpy as np

from sgm.eyes.scene import Scene

_SURE = 1 - 1e-6  # of all four pixels around a point
_ONE_STAND = 0.1  # metres within which frames are from one stand, beside the pose's uncertainty


class SeenPoints:
    """The points of the two volumes of a place, n each, united over frames.

    Beside an edge a pixel shows what lies half a pixel before or behind it. Frames from one stand
    of the camera repeat that error, so that their mean counts. The mean of all stands forgets what
    one of them alone has seen; the best of them errs to its own side of every edge. The middle
    between both decides.

    Attributes:
        is_sure: which points a frame had in view by all pixels around them, bool (2, n).
    """

    def __init__(self, num_points: int, at: np.ndarray) -> None:
        """Begin where the camera is, (3,)."""
        shape = 2, num_points
        self.is_sure = np.zeros(shape, dtype=bool)
        self._stand = at
        self._share, self._sum_mean, self._best = np.zeros((3, *shape))  # share: of this stand
        self._num_frames, self._num_stands = np.zeros((2, *shape), dtype=np.int64)

    def move(self, at: np.ndarray, position_sd: float) -> None:
        """Note where the camera is now, (3,), and how uncertain that is, metres."""
        if np.linalg.norm(at - self._stand) > _ONE_STAND + 2 * position_sd:
            self._leave_stand()
            self._stand = at

    def add(self, side: int, share: np.ndarray) -> None:
        """Take in how far the points of one volume are in view of a frame, 0 to 1, (n,)."""
        is_sure = share >= _SURE
        self.is_sure[side] |= is_sure
        is_doubtful = (share > 0) & ~is_sure
        self._share[side, is_doubtful] += share[is_doubtful]
        self._num_frames[side] += is_doubtful

    def find_seen(self) -> np.ndarray:
        """Return which points were in view, bool (2, n)."""
        self._leave_stand()
        mean = self._sum_mean / np.maximum(self._num_stands, 1)
        return self.is_sure | (mean + self._best >= 1)

    def compute_coverage(self, scene: Scene, place: int, most: float = 1.0) -> dict[str, float]:
        """Return the share in view of what is "in" and "onTop" of the place, `most` at most.

        Where there is no inside, that is the share of the upper side: nothing else is to be seen.
        """
        num_free = np.maximum(scene.num_free[2 * place : 2 * place + 2], 1)
        inside, on_top = (self.find_seen().sum(axis=1) / num_free).tolist()
        if not scene.has_inside[place]:
            inside = on_top
        elif not scene.num_free[2 * place + 1]:  # up to the ceiling, or below another box
            on_top = inside
        return {"in": min(inside, most), "onTop": min(on_top, most)}

    def _leave_stand(self) -> None:
        mean = self._share / np.maximum(self._num_frames, 1)
        self._sum_mean += mean
        self._best = np.maximum(self._best, mean)
        self._num_stands += mean > 0
        self._share[:], self._num_frames[:] = 0.0, 0

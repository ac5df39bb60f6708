"""Visits to places: frames that show a place one after the other are one look; its coverage."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.scene import Scene
from sgm.layout.viewpoint import Viewpoint
from sgm.schema import NUM_RELATIONS, RELATIONS, USUAL_RELATION, PlaceCode

_SURE = 1 - 1e-6  # of all four pixels around a point
_ONE_STAND = 0.1  # metres within which frames are from one stand, beside the pose's uncertainty
_ALWAYS = 128  # points of a volume that every frame projects, the first ones


class SeenPoints:
    """The points of the volumes of a place, n each, united over frames.

    Beside an edge a pixel shows what lies half a pixel before or behind it. Frames from one stand
    of the camera repeat that error, so that their mean counts. The mean of all stands forgets what
    one of them alone has seen; the best of them errs to its own side of every edge. The middle
    between both decides.

    Attributes:
        is_sure: which points a frame had in view by all pixels around them, bool (R, n).
    """

    def __init__(self, num_points: int, eye: np.ndarray) -> None:
        """Begin where the camera is, (3,)."""
        shape = NUM_RELATIONS, num_points
        self.is_sure = np.zeros(shape, dtype=bool)
        self._stand = eye
        self._share, self._sum_mean, self._best = np.zeros((3, *shape))  # share: of this stand
        self._num_frames, self._num_stands = np.zeros((2, *shape), dtype=np.int64)

    def move(self, eye: np.ndarray, position_sd: float) -> None:
        """Note where the camera is now, (3,), and how uncertain that is, metres."""
        if np.linalg.norm(eye - self._stand) > _ONE_STAND + 2 * position_sd:
            self._leave_stand()
            self._stand = eye

    def add(self, side: int, share: np.ndarray) -> None:
        """Take in how far the points of one volume are in view of a frame, 0 to 1, (n,)."""
        is_sure = share >= _SURE
        self.is_sure[side] |= is_sure
        is_doubtful = (share > 0) & ~is_sure
        self._share[side, is_doubtful] += share[is_doubtful]
        self._num_frames[side] += is_doubtful

    def find_seen(self) -> np.ndarray:
        """Return which points were in view, bool (R, n)."""
        stand = self._compute_mean()
        mean = (self._sum_mean + stand) / np.maximum(self._num_stands + (stand > 0), 1)
        return self.is_sure | (mean + np.maximum(self._best, stand) >= 1)

    def compute_coverage(self, scene: Scene, place: int, most: float = 1.0) -> dict[str, float]:
        """Return the share in view of what lies at the place, by relation, `most` at most.

        Of a relation without a volume, as "in" a table, that is the share of the usual relation:
        nothing else is to be seen.
        """
        volumes = slice(PlaceCode.count(place), PlaceCode.count(place + 1))
        num_free = scene.num_free[volumes]
        shares = self.find_seen().sum(axis=1) / np.maximum(num_free, 1)
        usual = RELATIONS.index(USUAL_RELATION)
        if not num_free[usual]:  # up to the ceiling, or below another box
            shares[usual] = shares.max()
        shares[~scene.has_volume[volumes]] = shares[usual]
        return dict(zip(RELATIONS, np.minimum(shares, most).tolist(), strict=True))

    def _compute_mean(self) -> np.ndarray:
        """Return how far the frames from this stand show the points, (R, n)."""
        return self._share / np.maximum(self._num_frames, 1)

    def _leave_stand(self) -> None:
        mean = self._compute_mean()
        self._sum_mean += mean
        self._best = np.maximum(self._best, mean)
        self._num_stands += mean > 0
        self._share[:], self._num_frames[:] = 0.0, 0


@dataclass(slots=True, eq=False)
class Visit:
    """A visit that goes on.

    Attributes:
        place: number in the scene.
        start, last: seconds of the first and the latest frame that showed it.
        points: which were in view.
        num_frames: frames that showed it.
        has_depth: whether all of them had a depth image.
        num_best: points that the frame showed that showed most.
        viewpoint: of its camera.
    """

    place: int
    start: float
    last: float
    points: SeenPoints
    num_frames: int = 0
    has_depth: bool = True
    num_best: int = 0
    viewpoint: Viewpoint | None = None


class Visits:
    """The visits that go on, one a place."""

    def __init__(self, scene: Scene) -> None:
        """Start with none."""
        self._scene = scene
        self._open: dict[int, Visit] = {}

    def begin(self, place: int, time: float, eye: np.ndarray) -> None:
        """Begin a visit to a place that a thing was seen at before it was known, if none goes on.

        `eye` is where the camera is, (3,).
        """
        if place not in self._open:
            points = SeenPoints(self._scene.points.shape[1], eye)
            self._open[place] = Visit(place, time, time, points, num_frames=1)

    def list_known(self, volumes: np.ndarray) -> np.ndarray:
        """Return which points a frame need not show again, as their visit has seen them, (v, n).

        The first points are always looked at: they say whether a place is in view now.
        """
        known = np.zeros((len(volumes), self._scene.points.shape[1]), dtype=bool)
        for row, volume in enumerate(volumes.tolist()):
            visit = self._open.get(PlaceCode.furniture(volume))
            if visit is not None:
                known[row, _ALWAYS:] = visit.points.is_sure[PlaceCode.relation(volume), _ALWAYS:]
        return known

    def note_points(
        self, time: float, volumes: np.ndarray, share: np.ndarray, view: CameraView
    ) -> set[int]:
        """Unite the points of volumes (k,) that a frame shows, and return its places.

        `share` is how far each of their points is in view, 0 to 1, (k, n).
        """
        shown = set()
        # Of points that every frame is asked for: the others are known after some frames.
        num_shown = np.count_nonzero(share[:, :_ALWAYS] >= 0.5, axis=1)
        for row in np.flatnonzero((share >= 0.5).any(axis=1)):
            volume = int(volumes[row])
            place, relation = PlaceCode.split(volume)
            visit = self._continue(place, time, view)
            visit.points.add(relation, share[row])
            visit.has_depth &= view.has_depth
            if num_shown[row] > visit.num_best:
                visit.num_best, visit.viewpoint = int(num_shown[row]), view.make_viewpoint()
            shown.add(place)
        return shown

    def note_frame(self, time: float, places: set[int], view: CameraView) -> None:
        """Count a frame for the places that it shows, or in which it shows a thing."""
        for place in places:
            visit = self._continue(place, time, view)
            visit.last = time
            visit.num_frames += 1
            if visit.viewpoint is None:
                visit.viewpoint = view.make_viewpoint()

    def list_open(self, since: float) -> list[Visit]:
        """Return the visits whose place was in view at a time, in seconds, or later."""
        return [visit for visit in self._open.values() if visit.last >= since]

    def take_ended(
        self, time: float = math.inf, pause: float = 0.0, longest: float = math.inf
    ) -> list[Visit]:
        """Take out the visits whose place was out of view for `pause` s, or that last `longest`.

        By default, all of them.
        """
        ended = [
            visit
            for visit in self._open.values()
            if time - visit.last > pause or visit.last - visit.start >= longest
        ]
        for visit in ended:
            del self._open[visit.place]
        return ended

    def _continue(self, place: int, time: float, view: CameraView) -> Visit:
        """Return the visit to a place, which begins or goes on with a frame."""
        visit, eye = self._open.get(place), view.pose.position
        if visit is None:
            points = SeenPoints(self._scene.points.shape[1], eye)
            visit = self._open[place] = Visit(place, time, time, points)
        visit.points.move(eye, view.pose.position_sd)
        return visit

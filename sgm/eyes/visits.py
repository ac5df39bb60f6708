"""Visits to places: frames that show a place one after the other are one look."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.eyes.scene import Scene
from sgm.eyes.seen_points import SeenPoints
from sgm.layout.viewpoint import Viewpoint

_ALWAYS = 128  # points of a volume that every frame projects, the first ones


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

    def list_known(self, volumes: np.ndarray) -> np.ndarray:
        """Return which points a frame need not show again, as their visit has seen them, (v, n).

        The first points are always looked at: they say whether a place is in view now.
        """
        known = np.zeros((len(volumes), self._scene.points.shape[1]), dtype=bool)
        for row, volume in enumerate(volumes.tolist()):
            visit = self._open.get(volume // 2)
            if visit is not None:
                known[row, _ALWAYS:] = visit.points.is_sure[volume % 2, _ALWAYS:]
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
            visit = self._continue(volume // 2, time, view)
            visit.points.add(volume % 2, share[row])
            visit.has_depth &= view.has_depth
            if num_shown[row] > visit.num_best:
                visit.num_best, visit.viewpoint = int(num_shown[row]), view.make_viewpoint()
            shown.add(volume // 2)
        return shown

    def note_frame(self, time: float, places: set[int], view: CameraView) -> None:
        """Count a frame for the places that it shows, or in which it shows a thing."""
        for place in places:
            visit = self._continue(place, time, view)
            visit.last = time
            visit.num_frames += 1
            if visit.viewpoint is None:
                visit.viewpoint = view.make_viewpoint()

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
        visit, at = self._open.get(place), view.pose.position
        if visit is None:
            points = SeenPoints(self._scene.points.shape[1], at)
            visit = self._open[place] = Visit(place, time, time, points)
        visit.points.move(at, view.pose.position_sd)
        return visit

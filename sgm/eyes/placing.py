"""At which places the detections of frames are, and which of them are at none."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection, Located, Measured, locate
from sgm.camera.rays import Bodies, trace_rays
from sgm.camera.scene import NOWHERE, Scene, compute_entries
from sgm.eyes.look_rules import Gate, LookRules
from sgm.layout.box import ABOVE_TOP, BELOW_TOP
from sgm.layout.outline import compute_outline_distance
from sgm.names.ignored import IgnoredNames
from sgm.schema import INSIDE, IS_BORNE, ON_TOP, RELATIONS, PlaceCode

THROUGH = "detections that depth goes through"  # as they are counted
_IN_SIGHT = 2.0  # standard deviations of the pose by which volumes are dilated
_CENTER_SD = 0.02  # metres, of a center that a detector names
_MOST_HALF = 0.25  # metres, of half a thing whose size is unknown
_LEAST_HEIGHT = 0.01  # metres
_MOST_UNASSIGNED = 1000  # kept for the user

OnDetection = Callable[[Detection, int | None, str | None], None]


@dataclass(frozen=True, slots=True)
class Unassigned:
    """A detection that is at no known place.

    Attributes:
        detection: what was seen.
        time: of its frame, seconds.
        center: where in the map, x, y, z; None if it is unknown.
    """

    detection: Detection
    time: float
    center: tuple[float, float, float] | None


class Placing:
    """Finds the volume that each detection of a frame lies in.

    Attributes:
        unassigned: the latest detections at no known place.
    """

    def __init__(
        self,
        gate: Gate,
        rules: LookRules,
        ignore: Iterable[str],
        counts: Counter[str],
        on_detection: OnDetection | None,
    ) -> None:
        """Begin without a detection.

        Args:
            gate: of detections.
            rules: by how much volumes are larger, and which rays went through things.
            ignore: names of what is no thing.
            counts: are kept up.
            on_detection: as in `LookBuilder`.
        """
        self.unassigned: deque[Unassigned] = deque(maxlen=_MOST_UNASSIGNED)
        self._gate = gate
        self._dilation, self._through_margin = rules.dilation, rules.through_margin
        self._ignored = IgnoredNames(ignore)
        self._counts, self._on_detection = counts, on_detection

    def select(self, detections: Sequence[Detection]) -> list[Detection]:
        """Return the detections of a frame that count: not ignored, and of no low score."""
        self._counts["detections"] += len(detections)
        wanted = [detection for detection in detections if detection.name not in self._ignored]
        self._count("detections ignored", len(detections) - len(wanted))
        sure = [detection for detection in wanted if detection.score >= self._gate.least_score]
        self._counts["detections of low score"] += len(wanted) - len(sure)
        return sure

    def place(
        self, scene: Scene, time: float, view: CameraView, things: Sequence[Detection]
    ) -> Iterator[tuple[Detection, int, Measured]]:
        """Yield detections of things in reach, their volumes, `NOWHERE` for none, and where."""
        for detection, volume, measured in self._assign(scene, view, things):
            is_known = volume != NOWHERE
            if self._on_detection is not None:
                self._on_detection(
                    detection,
                    scene.ids[PlaceCode.furniture(volume)] if is_known else None,
                    RELATIONS[PlaceCode.relation(volume)] if is_known else None,
                )
            if not is_known:
                self._counts["detections at no place"] += 1
                center = (
                    tuple(measured.center.tolist()) if np.isfinite(measured.center).all() else None
                )
                self.unassigned.append(Unassigned(detection, time, center))
            yield detection, volume, measured

    def _count(self, name: str, number: int) -> None:
        if number:
            self._counts[name] += number

    def _assign(
        self, scene: Scene, view: CameraView, detections: Sequence[Detection]
    ) -> Iterator[tuple[Detection, int, Measured]]:
        """Go through the detections in reach, at a place or at none."""
        gate = self._gate
        located, lost = locate(view, detections)
        volumes = assign(scene, located, self._dilation)
        distance = np.linalg.norm(located.center - view.pose.position, axis=1)
        faults = self._find_faults(view, located, volumes)
        for row, detection in enumerate(located.detections):
            if not gate.nearest <= distance[row] <= gate.farthest:
                self._counts["detections out of range"] += 1
            elif faults[row]:
                self._counts[faults[row]] += 1
            else:
                yield detection, int(volumes[row]), located.get(row)
        for detection in lost:
            if view.has_depth:
                self._counts["detections without depth"] += 1
                continue
            volume, measured = assign_by_ray(scene, view, detection, self._dilation, gate.farthest)
            yield detection, volume, measured

    def _find_faults(self, view: CameraView, located: Located, volumes: np.ndarray) -> list[str]:
        """Say of each of k things why the camera cannot have seen it, "" for what it can have.

        Whose detection names its center may be one that the detector only knows of.
        """
        faults = [""] * len(located.detections)
        named = np.array([row.center is not None for row in located.detections], dtype=bool)
        rows = np.flatnonzero(named)
        if not len(rows):
            return faults
        center, sd = located.center[rows], np.full(len(rows), _CENTER_SD)
        # With depth, what was measured decides, whatever the map says; else its boxes hide.
        volume = np.full(len(rows), NOWHERE) if view.has_depth else volumes[rows]
        bodies = Bodies(center, located.radius[rows], located.height[rows], sd, volume)
        traced = trace_rays(view, bodies, self._through_margin, is_flat_gone=False)
        is_through = traced.is_through & view.has_depth  # else nothing was measured
        is_in = view.contains(center)
        # What is measured before the middle may be the thing itself.
        half = [_measure_half(located.detections[row]) for row in rows]
        is_hidden = traced.farthest < -(np.array(half) + self._through_margin + 2 * _CENTER_SD)
        for number, row in enumerate(rows.tolist()):
            if not is_in[number]:
                faults[row] = "detections outside the image"
            elif is_hidden[number]:
                faults[row] = "detections behind what was measured"
            elif is_through[number]:
                faults[row] = THROUGH
        return faults


def _measure_half(detection: Detection) -> float:
    """Return half the diagonal of a thing, metres, and what it may be where that is unknown."""
    return _MOST_HALF if detection.size is None else math.hypot(*detection.size) / 2


def assign(scene: Scene, located: Located, dilation: float) -> np.ndarray:
    """Return the volume that each of k things lies in, -1 for none, (k,).

    Volumes are dilated by `dilation` and twice the standard deviation of the thing. Of those that
    contain all of it or its middle, the one is taken whose supporting surface is nearest to the
    lower side of the thing; but for the upper side, that may be at any height. Of equally near
    ones, the one whose middle is nearest. `dilation` is in metres.
    """
    volumes = scene.list_volumes()
    if not len(volumes) or not len(located.center):
        return np.full(len(located.center), NOWHERE)
    places, relations = PlaceCode.split(volumes)
    is_borne = IS_BORNE[relations]
    offset = located.center[:, None] - scene.volume_center[volumes]
    local = np.einsum("kvi,vij->kvj", offset, scene.rotation[places])
    outside = np.maximum(np.abs(local) - scene.volume_half[volumes], 0)
    beside = np.hypot(outside[..., 0], outside[..., 1])  # (k, v)
    for column, place in enumerate(places.tolist()):
        if place in scene.outlines:
            flat = local[:, column, :2]
            beside[:, column] = compute_outline_distance(scene.outlines[place], flat)
    allowed = dilation + _IN_SIGHT * located.sd[:, None]
    bottom, height = located.bottom[:, None], located.height[:, None]

    above = bottom - (scene.center + scene.half)[places, 2]  # of the upper side
    is_on = (above >= -BELOW_TOP - allowed) & (above <= ABOVE_TOP + allowed)
    lowest = (scene.volume_center - scene.volume_half)[volumes, 2]
    highest = np.maximum((scene.volume_center + scene.volume_half)[volumes, 2], lowest + height)
    beyond = np.maximum(np.maximum(lowest - bottom, bottom + height - highest), 0)
    gap = np.where(is_borne, np.abs(above), beyond)
    fits = np.where(is_borne, is_on, np.hypot(beside, beyond) <= allowed) & (beside <= allowed)
    # How high a thing is that lies along the ray is only guessed: its middle alone will do.
    fits |= np.hypot(beside, outside[..., 2]) <= allowed
    cost = np.where(fits, np.hypot(gap, beside), np.inf)
    cost += 1e-6 * np.linalg.norm(offset, axis=2)
    best = cost.argmin(axis=1)
    return np.where(np.isfinite(cost.min(axis=1)), volumes[best], NOWHERE)


def assign_by_ray(
    scene: Scene, view: CameraView, detection: Detection, dilation: float, farthest: float
) -> tuple[int, Measured]:
    """Return the volume of a thing without a depth, -1 for none, and where it stands.

    The ray through the lower side of its box ends on the surface that it stands on: the first box
    that it meets. Through an upper side that is on top, from `dilation` metres below it on; through
    the open front it is inside. Things are seen up to the distance `farthest`, in metres.
    """
    assert detection.box is not None
    left, top, right, bottom = detection.box
    pixel = np.array([[(left + right) / 2, bottom]])
    ray = view.pose.to_map(view.intrinsics.unproject(pixel, np.ones(1))) - view.pose.position
    ray /= np.linalg.norm(ray)
    places = np.arange(len(scene.ids))
    entry, leave, axis = (
        values[0] for values in compute_entries(scene, view.pose.position, ray, places)
    )
    meets = (entry < leave) & (entry > 0) & (entry <= farthest)
    if not meets.any():
        return NOWHERE, Measured(np.full(3, np.nan), 0.0, 0.0, 0.0)
    place = int(np.where(meets, entry, np.inf).argmin())
    away = float(entry[place])
    height = max((bottom - top) * away / view.intrinsics.fy, _LEAST_HEIGHT)
    radius = (right - left) * away / view.intrinsics.fx / 2
    foot, sd = view.pose.position + ray[0] * away, float(view.pose.compute_sd(entry[place]))
    measured = Measured(foot + np.array([0.0, 0.0, height / 2]), radius, height, sd)

    upper = scene.center[place, 2] + scene.half[place, 2]
    if foot[2] > upper - BELOW_TOP - dilation - _IN_SIGHT * sd:
        return PlaceCode.of(place, ON_TOP), measured
    start = scene.to_own(view.pose.position[None], np.array([place]))[0, 0, 0]
    is_front = axis[place] == 0 and start > scene.half[place, 0]
    if scene.has_inside[place] and scene.is_open[place] and is_front:
        return PlaceCode.of(place, INSIDE), measured
    return NOWHERE, measured

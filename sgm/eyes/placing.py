"""At which places the detections of frames are, and which of them are at none."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sgm.eyes.assignment import NOWHERE, assign, assign_by_ray
from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import Detection
from sgm.eyes.gate import Gate
from sgm.eyes.located import Measured, locate
from sgm.eyes.scene import Scene
from sgm.memory.sighting import RELATIONS

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
        self, gate: Gate, dilation: float, counts: Counter[str], on_detection: OnDetection | None
    ) -> None:
        """Begin without a detection; `counts` are kept up, `on_detection` is as in `LookBuilder`.

        Volumes are larger by `dilation` in metres, beside the uncertainty of the pose.
        """
        self.unassigned: deque[Unassigned] = deque(maxlen=_MOST_UNASSIGNED)
        self._gate, self._dilation = gate, dilation
        self._counts, self._on_detection = counts, on_detection

    def place(
        self, scene: Scene, time: float, view: CameraView, detections: Sequence[Detection]
    ) -> Iterator[tuple[Detection, int, Measured]]:
        """Yield detections of a frame that are at a place, their volumes, and where they are."""
        self._counts["detections"] += len(detections)
        sure = [one for one in detections if one.score >= self._gate.least_score]
        self._counts["detections of low score"] += len(detections) - len(sure)
        for detection, volume, at in self._assign(scene, view, sure):
            is_known = volume != NOWHERE
            if self._on_detection is not None:
                self._on_detection(
                    detection,
                    scene.ids[volume // 2] if is_known else None,
                    RELATIONS[volume % 2] if is_known else None,
                )
            if is_known:
                yield detection, volume, at
                continue
            self._counts["detections at no place"] += 1
            center = tuple(at.center.tolist()) if np.isfinite(at.center).all() else None
            self.unassigned.append(Unassigned(detection, time, center))

    def _assign(
        self, scene: Scene, view: CameraView, detections: Sequence[Detection]
    ) -> Iterator[tuple[Detection, int, Measured]]:
        """Go through the detections in reach, at a place or at none."""
        gate = self._gate
        located, lost = locate(view, detections)
        volumes = assign(scene, located, self._dilation)
        distance = np.linalg.norm(located.center - view.pose.position, axis=1)
        for row, detection in enumerate(located.detections):
            if gate.nearest <= distance[row] <= gate.farthest:
                yield detection, int(volumes[row]), located.get(row)
            else:
                self._counts["detections out of range"] += 1
        for detection in lost:
            if view.has_depth:
                self._counts["detections without depth"] += 1
                continue
            volume, at = assign_by_ray(scene, view, detection, self._dilation, gate.farthest)
            yield detection, volume, at

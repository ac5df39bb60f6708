"""Which detections are of furniture itself, rather than of things on it."""

from __future__ import annotations

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import Detection
from sgm.eyes.furniture_labels import FurnitureLabels
from sgm.eyes.scene import Scene, compute_entries

_GRID = np.linspace(-0.4, 0.4, 7)  # of the sides of a box in pixels, around its middle
_LEAST_SHARE = 0.25  # of the points of a detection that must lie in furniture to be of it


class KnownFurniture:
    """Tells detections of the furniture of a scene from those of things.

    A detection is of a piece of furniture if its name may be of it (`FurnitureLabels.are_same`),
    and a quarter of the points of its box lies in that of the furniture; of a detection with a
    center, that.
    """

    def __init__(self, labels: FurnitureLabels, scene: Scene) -> None:
        """Take the furniture of a scene that has names."""
        self._labels, self._scene = labels, scene
        self._places: dict[str, np.ndarray] = {}  # that a name may be of, by the name

    def find(self, view: CameraView, detection: Detection, dilation: float) -> int | None:
        """Return the id of the furniture that a detection is of, None for none.

        `dilation` is in metres.
        """
        places = self._places.get(detection.name)
        if places is None:
            places = self._places[detection.name] = self._list_places(detection.name)
        if not len(places):
            return None
        share = compute_shares(view, self._scene, detection, places, dilation)
        best = int(share.argmax())
        return self._scene.ids[int(places[best])] if share[best] >= _LEAST_SHARE else None

    def _list_places(self, name: str) -> np.ndarray:
        return np.array(
            [
                place
                for place, names in enumerate(self._scene.names)
                if any(self._labels.are_same(name, own) for own in names)
            ],
            dtype=np.int64,
        )


def compute_shares(
    view: CameraView, scene: Scene, detection: Detection, places: np.ndarray, dilation: float
) -> np.ndarray:
    """Return the share of the points of a detection that lie in places (k,), (k,).

    Boxes are larger by `dilation` in metres, and twice the uncertainty of the pose. Without a depth
    image, it is the share of the rays through the detection that meet a place.
    """
    if detection.center is None and not view.has_depth:
        rays = list_rays(view, detection)
        entry, leave, _ = compute_entries(scene, view.pose.position, rays, places)
        return np.asarray(((entry < leave) & (leave > 0)).mean(axis=0))
    if detection.center is not None:
        points = np.array([detection.center])
    else:
        points = measure_points(view, detection)
        if not len(points):
            return np.zeros(len(places))
    distance = np.linalg.norm(points - view.pose.position, axis=1)
    allowed = dilation + 2 * view.pose.compute_sd(distance)
    own = np.abs(scene.to_own(points, places)) - scene.half[places]  # (n, k, 3)
    is_in = np.linalg.norm(np.maximum(own, 0), axis=2) <= allowed[:, None]
    return np.asarray(is_in.mean(axis=0))


def list_pixels(detection: Detection, steps: np.ndarray = _GRID) -> np.ndarray:
    """Return pixels over the box of a detection, columns and rows, (n, 2)."""
    assert detection.box is not None
    left, top, right, bottom = detection.box
    columns = (left + right) / 2 + (right - left) * steps
    rows = (top + bottom) / 2 + (bottom - top) * steps
    return np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)


def list_rays(view: CameraView, detection: Detection) -> np.ndarray:
    """Return the directions of rays through the box of a detection, in the map, (n, 3)."""
    pixels = list_pixels(detection)
    points = view.pose.to_map(view.intrinsics.unproject(pixels, np.ones(len(pixels))))
    return points - view.pose.position


def measure_points(view: CameraView, detection: Detection) -> np.ndarray:
    """Return the measured points over the box of a detection, in the map, (n, 3)."""
    pixels = list_pixels(detection)
    return view.measure_points(pixels[view.intrinsics.contains(pixels)])

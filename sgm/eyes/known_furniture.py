"""Which detections are of furniture itself, rather than of things on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection
from sgm.camera.scene import Scene, compute_entries
from sgm.mapping.furniture_labels import FurnitureLabels

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

    def find(
        self, view: CameraView, detections: Sequence[Detection], dilation: float
    ) -> list[int | None]:
        """Return the ids of the furniture that detections are of, None for none.

        `dilation` is in metres.
        """
        found: list[int | None] = [None] * len(detections)
        numbers = [
            number
            for number, detection in enumerate(detections)
            if len(self._get_places(detection.name))
        ]
        places = [self._get_places(detections[number].name) for number in numbers]
        asked = [detections[number] for number in numbers]
        for number, candidates, share in zip(
            numbers, places, compute_shares(view, self._scene, asked, places, dilation), strict=True
        ):
            best = int(share.argmax())
            if share[best] >= _LEAST_SHARE:
                found[number] = self._scene.ids[int(candidates[best])]
        return found

    def _get_places(self, name: str) -> np.ndarray:
        places = self._places.get(name)
        if places is None:
            places = self._places[name] = self._list_places(name)
        return places

    def _list_places(self, name: str) -> np.ndarray:
        return np.array(
            [
                place
                for place, names in enumerate(self._scene.names)
                if any(self._labels.are_same(name, called) for called in names)
            ],
            dtype=np.int64,
        )


def compute_shares(
    view: CameraView,
    scene: Scene,
    detections: Sequence[Detection],
    places: Sequence[np.ndarray],
    dilation: float,
) -> list[np.ndarray]:
    """Return the share of the points of each detection that lie in its places (k,), (k,) each.

    Boxes are larger by `dilation` in metres, and twice the uncertainty of the pose. Without a depth
    image, it is the share of the rays through the detection that meet a place.
    """
    if not detections:
        return []
    if not view.has_depth and all(detection.center is None for detection in detections):
        return [
            _meet(view, scene, detection, candidates)
            for detection, candidates in zip(detections, places, strict=True)
        ]
    points, is_known = _locate(view, detections)  # (n, p, 3), (n, p)
    away = np.linalg.norm(points - view.pose.position, axis=2)
    allowed = dilation + 2 * view.pose.compute_sd(away)
    number = np.repeat(np.arange(len(places)), [len(candidates) for candidates in places])
    place = np.concatenate(places)  # of each pair (q,)
    offset = points[number] - scene.center[place][:, None]
    beyond = np.abs(offset @ scene.rotation[place]) - scene.half[place][:, None]  # (q, p, 3)
    is_in = (np.maximum(beyond, 0) ** 2).sum(axis=2) <= allowed[number] ** 2
    count = (is_in & is_known[number]).sum(axis=1)
    share = count / np.maximum(is_known.sum(axis=1), 1)[number]
    shares = np.split(share, np.cumsum([len(candidates) for candidates in places])[:-1])
    for index, detection in enumerate(detections):
        if detection.center is None and not view.has_depth:
            shares[index] = _meet(view, scene, detection, places[index])
    return shares


def _meet(view: CameraView, scene: Scene, detection: Detection, places: np.ndarray) -> np.ndarray:
    """Return the share of the rays through a detection that meet places (k,), (k,)."""
    rays = list_rays(view, detection)
    entry, leave, _ = compute_entries(scene, view.pose.position, rays, places)
    return np.asarray(((entry < leave) & (leave > 0)).mean(axis=0))


def _locate(view: CameraView, detections: Sequence[Detection]) -> tuple[np.ndarray, np.ndarray]:
    """Return points of detections in the map (n, p, 3), and which of them are known, (n, p).

    A detection with a center is at that alone.
    """
    pixels = np.stack(
        [
            np.zeros((len(_GRID) ** 2, 2)) if detection.center else list_pixels(detection)
            for detection in detections
        ]
    )
    flat = pixels.reshape(-1, 2)
    points, is_known, _ = view.measure_pixels(flat)
    is_known &= view.intrinsics.contains(flat)
    points, is_known = points.reshape(*pixels.shape[:2], 3), is_known.reshape(pixels.shape[:2])
    for number, detection in enumerate(detections):
        if detection.center is not None:
            points[number], is_known[number] = detection.center, True
    return points, is_known


def list_pixels(detection: Detection) -> np.ndarray:
    """Return pixels over the box of a detection, columns and rows, (n, 2)."""
    assert detection.box is not None
    left, top, right, bottom = detection.box
    columns = (left + right) / 2 + (right - left) * _GRID
    rows = (top + bottom) / 2 + (bottom - top) * _GRID
    return np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)


def list_rays(view: CameraView, detection: Detection) -> np.ndarray:
    """Return the directions of rays through the box of a detection, in the map, (n, 3)."""
    pixels = list_pixels(detection)
    points = view.pose.to_map(view.intrinsics.unproject(pixels, np.ones(len(pixels))))
    return points - view.pose.position

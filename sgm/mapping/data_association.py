"""Which of the furniture that was seen before the detections of a frame are of."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection
from sgm.layout.box import Box
from sgm.mapping.box_fit import compute_overlaps
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_points import Points
from sgm.mapping.landmark import Landmark

REACH = 0.15  # metres around a box within which a detection of its label is of it
_LEAST_ALIKE = 0.08  # of that share times the overlap with how the box looks, and a tenth
_NOWHERE = 1e9  # metres: a point that there is not
_FAR = 1.5  # metres from a box at which none of its points are looked for
# Of the points of a detection, so many lie in the box of what it is of. Most may be of what stands
# before it; then its box must look much like that of the detection.
_LEAST_SHARE = 0.1


class DataAssociation:
    """The furniture that each detection of a frame may be of, the likeliest first.

    Furniture matches a detection of its label if many points of the detection lie in its box, and
    its box would look much like that of the detection. `prepare` compares many detections at once;
    `find` then answers for each.
    """

    def __init__(
        self, landmarks: Sequence[Landmark], labels: FurnitureLabels, view: CameraView
    ) -> None:
        """Take the furniture that has a box, as it was before the frame."""
        self._view, self._labels = view, labels
        drawn = [(landmark, landmark.box) for landmark in landmarks if landmark.box is not None]
        self._landmarks = [landmark for landmark, _ in drawn]
        self._boxes: list[Box] = [box for _, box in drawn]
        self._names = [tuple(landmark.names) for landmark in self._landmarks]
        self._center = np.array([box.center for box in self._boxes]).reshape(-1, 3)
        self._half = np.array([box.size for box in self._boxes]).reshape(-1, 3) / 2
        self._yaw = np.array([box.yaw for box in self._boxes])
        self._radius = np.linalg.norm(self._half, axis=1)
        self._is_same: dict[str, np.ndarray] = {}  # by label
        self._found: dict[int, list[Landmark]] = {}  # by number of the detection

    def prepare(
        self,
        detections: Sequence[Detection],
        labels: Sequence[str | None],
        shown: Sequence[Points],
        asked: Sequence[int],
    ) -> None:
        """Find what some detections may be of.

        Args:
            detections: of the frame.
            labels: of furniture, of each of them.
            shown: what each shows.
            asked: numbers of those that are asked about.
        """
        reach = REACH + 2 * float(self._view.pose.compute_sd(np.array(2.0)))
        self._found |= {index: [] for index in asked}
        seen_points = [shown[index][0][shown[index][1]] for index in asked]
        if not asked or not self._landmarks:
            return
        middle = np.array([points.mean(axis=0) for points in seen_points])
        is_same = np.array([self._list_same(labels[index]) for index in asked])
        is_near = np.linalg.norm(middle[:, None] - self._center, axis=2) <= self._radius + _FAR
        number, landmark = np.nonzero(is_same & is_near)
        share = self._compute_shares(seen_points, number, landmark, reach)
        is_found = share >= _LEAST_SHARE
        found = (part[is_found].tolist() for part in (number, landmark, share))
        pairs = [(asked[index], other, part) for index, other, part in zip(*found, strict=True)]
        self._order(detections, pairs)

    def find(self, number: int, taken: Container[int]) -> Landmark | None:
        """Return what a detection is of, of what was not taken by another one, by its number."""
        return next(
            (landmark for landmark in self._found[number] if landmark.number not in taken), None
        )

    def _list_same(self, label: str | None) -> np.ndarray:
        """Tell which landmarks may be of a label, (S,)."""
        if label is None:
            return np.zeros(len(self._landmarks), dtype=bool)
        known = self._is_same.get(label)
        if known is None:
            are_same = self._labels.are_same
            is_same = {
                names: any(are_same(label, name) for name in names) for names in {*self._names}
            }
            known = self._is_same[label] = np.array([is_same[names] for names in self._names], bool)
        return known

    def _compute_shares(
        self, points: Sequence[np.ndarray], number: np.ndarray, landmark: np.ndarray, reach: float
    ) -> np.ndarray:
        """Return the share of the points of detections that lie within reach of boxes.

        Args:
            points: of each detection, (n, 3) each.
            number: of the detection of each pair, (p,).
            landmark: number of the box of each pair, (p,).
            reach: metres.

        Returns:
            Of each pair, (p,).
        """
        num_points = np.array([len(shown) for shown in points])
        flat = np.full((len(points), num_points.max(), 3), _NOWHERE)
        for padded, shown in zip(flat, points, strict=True):
            padded[: len(shown)] = shown
        x, y, z = flat.transpose(2, 0, 1)[:, number] - self._center[landmark].T[..., None]  # (p, n)
        cos, sin = np.cos(self._yaw[landmark])[:, None], np.sin(self._yaw[landmark])[:, None]
        half = self._half[landmark].T[..., None]
        beyond = np.maximum(np.abs(cos * x + sin * y) - half[0], 0) ** 2
        beyond += np.maximum(np.abs(cos * y - sin * x) - half[1], 0) ** 2
        beyond += np.maximum(np.abs(z) - half[2], 0) ** 2
        share: np.ndarray = (beyond <= reach**2).sum(axis=1) / num_points[number]
        return share

    def _order(
        self, detections: Sequence[Detection], pairs: Sequence[tuple[int, int, float]]
    ) -> None:
        """Put what each detection may be of in order, of pairs with what it may be."""
        alike = np.array([share for *_, share in pairs])
        seen = [detections[index].box for index, *_ in pairs]
        is_seen = np.array([box is not None for box in seen], dtype=bool)
        if is_seen.any():
            boxes = [self._boxes[pairs[number][1]] for number in np.flatnonzero(is_seen).tolist()]
            pixels = np.array([box for box in seen if box is not None])
            alike[is_seen] *= 0.1 + compute_overlaps(self._view, boxes, pixels)
        for number in np.argsort(-alike, kind="stable").tolist():
            if alike[number] > _LEAST_ALIKE:
                index, landmark, _ = pairs[number]
                self._found[index].append(self._landmarks[landmark])

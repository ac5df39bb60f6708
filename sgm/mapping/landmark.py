"""What may be a piece of furniture: what frames have shown of it, and the box that this makes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.camera.silhouettes import Silhouettes
from sgm.layout.box import Box
from sgm.mapping.box_fit import compute_likeness, fit_boxes
from sgm.mapping.furniture_cells import FurnitureCells


@dataclass(slots=True, eq=False)
class Landmark:
    """What may be a piece of furniture.

    Attributes:
        number: tells it from all others of a mapper.
        names: how often it was called what.
        cells: that were seen of it.
        silhouettes: boxes in pixels around it.
        num_frames: in which it was detected.
        sum_sd: of the standard deviations of their poses, metres.
        low, high: of the places of the camera from which it was, x, y, z, (3,).
        sum_eye: of these places, (3,).
        box: drawn so far; None while too little was seen.
        furniture: its id in the memory; None while it is not believed.
        num_drawn: frames when it was drawn last.
        likeness: mean overlap of detections with how the box looks, 0 to 1.
        beside: how often each other landmark, by its number, was detected in the same frame.
        num_shown, num_named: latest frames in which its middle was in view, and those of them in
            which it was detected.
    """

    number: int
    names: Counter[str] = field(default_factory=Counter)
    cells: FurnitureCells = field(default_factory=FurnitureCells)
    silhouettes: Silhouettes = field(default_factory=Silhouettes)
    num_frames: int = 0
    sum_sd: float = 0.0
    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))
    sum_eye: np.ndarray = field(default_factory=lambda: np.zeros(3))
    box: Box | None = None
    furniture: int | None = None
    num_drawn: int = 0
    likeness: float = 0.0
    beside: Counter[int] = field(default_factory=Counter)
    num_shown: float = 0.0
    num_named: float = 0.0

    @property
    def label(self) -> str:
        """What it was called most often."""
        return self.names.most_common(1)[0][0]

    @property
    def is_due(self) -> bool:
        """Whether it has enough frames since it was drawn last to be drawn anew."""
        return not self.num_drawn or self.num_frames >= 2 * max(self.num_drawn, 1)

    def add(
        self, label: str, eye: np.ndarray, sd: float, points: np.ndarray, is_within: np.ndarray
    ) -> None:
        """Take in a detection: its points (n, 3), and which of them are within its box (n,)."""
        self.names[label] += 1
        self.cells.add(points, is_within)
        self.num_frames += 1
        self.sum_sd += sd
        self.low, self.high = np.minimum(self.low, eye), np.maximum(self.high, eye)
        self.sum_eye += eye

    def join(self, other: Landmark) -> None:
        """Take in what is of the same furniture."""
        self.names += other.names
        self.cells.join(other.cells)
        self.silhouettes.join(other.silhouettes)
        self.num_frames += other.num_frames
        self.sum_sd += other.sum_sd
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        self.sum_eye += other.sum_eye
        if self.furniture is None:
            self.furniture = other.furniture

    def move(self, turn: np.ndarray, shift: np.ndarray) -> None:
        """Turn all that was seen by a rotation (3, 3) around the origin, and shift it (3,)."""
        self.cells.move(turn, shift)
        self.silhouettes.move(turn, shift)
        ends = np.stack([self.low, self.high]) @ turn.T + shift
        self.low, self.high = ends.min(axis=0), ends.max(axis=0)
        self.sum_eye = turn @ self.sum_eye + self.num_frames * shift
        if self.box is not None:
            center = turn @ self.box.center + shift
            yaw = self.box.yaw + math.atan2(turn[1, 0], turn[0, 0])
            self.box = replace(self.box, center=tuple(center.tolist()), yaw=yaw)


def draw_landmarks(landmarks: Iterable[Landmark], ground: float) -> None:
    """Draw the boxes of landmarks anew, where frames came since; `ground` is the floor's height."""
    due = [landmark for landmark in landmarks if landmark.num_drawn != landmark.num_frames]
    cells = [
        landmark.cells.fit(
            landmark.sum_eye / landmark.num_frames, ground, landmark.sum_sd / landmark.num_frames
        )
        for landmark in due
    ]
    drawn = [(landmark, box) for landmark, box in zip(due, cells, strict=True) if box is not None]
    fitted = fit_boxes(
        [landmark.silhouettes for landmark, _ in drawn], [box for _, box in drawn], ground
    )
    # Of the new box and the one before, that counts which explains better what was seen.
    boxes = [(landmark, box) for (landmark, _), box in zip(drawn, fitted, strict=True)]
    boxes += [(landmark, landmark.box) for landmark in due if landmark.box is not None]
    likeness = compute_likeness(
        [landmark.silhouettes for landmark, _ in boxes], [box for _, box in boxes]
    )
    best: set[int] = set()
    for number in np.argsort(-likeness, kind="stable").tolist():
        landmark, box = boxes[number]
        if landmark.number not in best:
            best.add(landmark.number)
            landmark.box, landmark.likeness = box, float(likeness[number])
    for landmark in due:
        landmark.num_drawn = landmark.num_frames


def count_beside(landmark: Landmark, other: Landmark) -> int:
    """Return in how many frames two landmarks were detected at once."""
    return landmark.beside[other.number] + other.beside[landmark.number]

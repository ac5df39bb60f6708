"""What may be a piece of furniture: what frames have shown of it, and the box that this makes."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.eyes.furniture_cells import FurnitureCells
from sgm.eyes.silhouettes import Silhouettes
from sgm.layout.box import Box


@dataclass(slots=True, eq=False)
class Sketch:
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
        beside: how often each other sketch, by its number, was detected in the same frame.
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

    def join(self, other: Sketch) -> None:
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

    def draw(self, ground: float) -> None:
        """Draw the box anew, where frames came since."""
        if self.num_drawn != self.num_frames:
            eye, sd = self.sum_eye / self.num_frames, self.sum_sd / self.num_frames
            drawn = self.cells.fit(eye, ground, sd)
            if drawn is not None:
                drawn = self.silhouettes.fit(drawn, ground)
            boxes = [box for box in (drawn, self.box) if box is not None]
            if boxes:  # the one that explains better what was seen, the new one first
                fits = [self.silhouettes.compute_overlap(box) for box in boxes]
                best = int(np.argmax(fits))
                self.box, self.likeness = boxes[best], fits[best]
            self.num_drawn = self.num_frames


def count_beside(sketch: Sketch, other: Sketch) -> int:
    """Return in how many frames two sketches were detected at once."""
    return sketch.beside[other.number] + other.beside[sketch.number]


def get_area(box: Box) -> float:
    """Return the area of a footprint, as a rectangle."""
    return box.size[0] * box.size[1]


def compute_overlap(box: Box, other: Box) -> tuple[float, float]:
    """Return the area of two footprints that is in both, and that in either, by points.

    0 where one stands above the other.
    """
    low, high = max(box.bottom, other.bottom), min(box.top, other.top)
    least = min(box.size[2], other.size[2])
    whole = get_area(box) + get_area(other)
    if (
        high - low < 0.3 * least
        or math.dist(box.center[:2], other.center[:2])
        > (math.hypot(*box.size[:2]) + math.hypot(*other.size[:2])) / 2
    ):
        return 0.0, whole
    small, large = sorted((box, other), key=get_area)
    steps = (np.arange(20) + 0.5) / 20 - 0.5
    flat = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * small.size[:2]
    points = small.to_map(np.column_stack([flat, np.zeros(len(flat))]))
    points[:, 2] = large.center[2]
    both = float(large.contains(points).mean()) * get_area(small)
    return both, whole - both

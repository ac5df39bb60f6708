"""A detector that misses small, far and hidden things, and names some of them wrongly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.eyes.detection import Detection
from simulator.box_world.depth_camera import Shot
from simulator.box_world.world import BoxWorld


@dataclass(frozen=True, slots=True)
class Detected:
    """A detection, and what it is truly of.

    Attributes:
        detection: what the detector says.
        slot: the thing.
        is_named: whether its name is right.
    """

    detection: Detection
    slot: int
    is_named: bool


@dataclass(frozen=True, slots=True)
class BoxDetector:
    """How often things are seen, in each frame independently.

    The probability is the product of `best`, of 1 - exp(-n / usual_pixels) for n visible pixels,
    and of how much of the thing is visible, from 0 at `least_share` to 1 at twice that.

    Attributes:
        best: probability of seeing a large thing that nothing hides.
        usual_pixels: visible pixels of which 63 % of the things are seen.
        least_share: a thing of which less is visible is never seen.
        wrong_share: share of the detections with the name of another thing of the home.
        box_noise: standard deviation of every side of the box, pixels.
    """

    best: float = 0.95
    usual_pixels: float = 12.0
    least_share: float = 0.25
    wrong_share: float = 0.02
    box_noise: float = 0.5

    def compute_probability(self, num_visible: np.ndarray, num_alone: np.ndarray) -> np.ndarray:
        """Return how likely things of so many pixels are seen, (n,)."""
        share = num_visible / np.maximum(num_alone, 1)
        by_share = np.clip(share / self.least_share - 1, 0, 1)
        return self.best * (1 - np.exp(-num_visible / self.usual_pixels)) * by_share

    def detect(self, world: BoxWorld, shot: Shot, *, rng: np.random.Generator) -> list[Detected]:
        """Return what is seen in a picture; `rng` draws as many numbers whatever that is."""
        num_slots = world.homes.num_slots
        is_measured = np.isfinite(shot.true_depth)
        of_thing = (shot.owner >= 0) & (shot.owner < num_slots) & is_measured
        owner = shot.owner[of_thing]
        num_visible = np.bincount(owner, minlength=num_slots)
        draws = rng.random((num_slots, 4))
        noise = rng.normal(0.0, self.box_noise, (num_slots, 4))
        probability = self.compute_probability(num_visible, shot.num_alone[:num_slots])
        rows, columns = np.nonzero(of_thing)
        found = []
        present = np.flatnonzero(world.things.place >= 0)
        for slot in np.flatnonzero(draws[:, 0] < probability).tolist():
            own = owner == slot
            left, top = np.array([columns[own].min(), rows[own].min()]) - 0.5 + noise[slot, :2]
            right, bottom = np.array([columns[own].max(), rows[own].max()]) + 0.5 + noise[slot, 2:]
            is_named = bool(draws[slot, 1] >= self.wrong_share)
            named = slot if is_named else int(present[int(draws[slot, 2] * len(present))])
            score = (
                0.55 + 0.45 * math.sqrt(draws[slot, 3]) if is_named else 0.3 + 0.6 * draws[slot, 3]
            )
            detection = Detection(
                world.describe_thing(named),
                score,
                box=(min(left, right), min(top, bottom), max(left, right), max(top, bottom)),
            )
            found.append(Detected(detection, slot, is_named or named == slot))
        return found

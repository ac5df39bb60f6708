"""A camera that measures depth in a home of boxes, and a detector that reads its pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from sgm.camera.detection import Detection
from sgm.camera.pinhole import Intrinsics, Pose
from simulator.box_world.ray_kernel import Solids, cast_rays
from simulator.box_world.world import BoxWorld


def make_intrinsics(width: int = 160, height: int = 128, view: float = 75.0) -> Intrinsics:
    """Return those of a camera whose image is `view` degrees wide."""
    focal = width / 2 / math.tan(math.radians(view) / 2)
    return Intrinsics(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """What a camera shows at one moment.

    Attributes:
        depth: what was measured, z in metres, nan where nothing was, inf where all is too far and
            -inf where it is too near, as REP 117 of ROS says, float32 (rows, columns).
        true_depth: without noise, inf where nothing is, (rows, columns).
        owner: whose each pixel is, -1 for nothing, int32 (rows, columns).
        num_alone: pixels that each thing would take if nothing stood before it, (C,).
    """

    depth: np.ndarray
    true_depth: np.ndarray
    owner: np.ndarray
    num_alone: np.ndarray


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """What a camera with a depth sensor measures; about what sensors of homes do.

    Attributes:
        intrinsics: of the image.
        nearest, farthest: z between which depth is measured, metres.
        noise: standard deviation of depth at 1 m, metres; it grows with the square of depth.
        hole_share: share of the pixels without a measurement.
    """

    intrinsics: Intrinsics = field(default_factory=make_intrinsics)
    nearest: float = 0.25
    farthest: float = 5.0
    noise: float = 0.002
    hole_share: float = 0.01

    def shoot(
        self, solids: Solids, num_things: int, pose: Pose, *, rng: np.random.Generator
    ) -> Shot:
        """Take a picture from a true pose; the first owners of the solids are things, C."""
        camera = self.intrinsics
        depth, owner, num_alone = cast_rays(
            solids,
            np.ascontiguousarray(pose.position),
            np.ascontiguousarray(pose.rotation),
            (camera.fx, camera.fy),
            (camera.cx, camera.cy),
            (camera.height, camera.width),
            num_things,
        )
        noise = rng.standard_normal(depth.shape, dtype=np.float32)
        is_hole = rng.random(depth.shape, dtype=np.float32) < self.hole_share
        measured = np.where(
            is_hole, np.nan, depth + self.noise * np.minimum(depth, 1e3) ** 2 * noise
        )
        measured = measured.astype(np.float32)
        measured[~is_hole & (depth < self.nearest)] = -np.inf
        measured[~is_hole & (depth > self.farthest)] = np.inf
        return Shot(measured, depth, owner, num_alone)

    def shows(self, pose: Pose, points: np.ndarray) -> np.ndarray:
        """Tell which points (n, 3) lie within the image, hidden or not, bool (n,)."""
        with np.errstate(invalid="ignore"):
            return self.intrinsics.contains(self.intrinsics.project(pose.to_camera(points)))


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
class DetectedFurniture:
    """A detection of furniture, and the number of that in the world."""

    detection: Detection
    furniture: int


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
        furniture_pixels: visible pixels of which 63 % of the furniture is seen.
    """

    best: float = 0.95
    usual_pixels: float = 12.0
    least_share: float = 0.25
    wrong_share: float = 0.02
    box_noise: float = 0.5
    furniture_pixels: float = 100.0

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
            pixels = owner == slot
            left, top = (
                np.array([columns[pixels].min(), rows[pixels].min()]) - 0.5 + noise[slot, :2]
            )
            right, bottom = (
                np.array([columns[pixels].max(), rows[pixels].max()]) + 0.5 + noise[slot, 2:]
            )
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

    def detect_furniture(
        self, world: BoxWorld, shot: Shot, *, rng: np.random.Generator
    ) -> list[DetectedFurniture]:
        """Return the furniture that is seen in a picture; names are those of its labels.

        A wrong name is that of other furniture of the home.
        """
        first, num = world.homes.num_slots, world.num_furniture
        labels = world.homes.furniture_labels[0, :num].tolist()
        is_measured = np.isfinite(shot.true_depth)
        owner = np.where(is_measured, shot.owner - first, -1)
        num_visible = np.bincount(owner[(owner >= 0) & (owner < num)], minlength=num)
        draws = rng.random((num, 4))
        noise = rng.normal(0.0, self.box_noise, (num, 4))
        probability = self.best * (1 - np.exp(-num_visible / self.furniture_pixels))
        found = []
        for number in np.flatnonzero(draws[:, 0] < probability).tolist():
            rows, columns = np.nonzero(owner == number)
            left, top = np.array([columns.min(), rows.min()]) - 0.5 + noise[number, :2]
            right, bottom = np.array([columns.max(), rows.max()]) + 0.5 + noise[number, 2:]
            is_named = bool(draws[number, 1] >= self.wrong_share)
            named = number if is_named else int(draws[number, 2] * num)
            score = 0.55 + 0.45 * math.sqrt(draws[number, 3])
            box = min(left, right), min(top, bottom), max(left, right), max(top, bottom)
            found.append(DetectedFurniture(Detection(labels[named], score, box=box), number))
        return found

"""A camera that measures depth, in a home of boxes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from sgm.eyes.camera import Intrinsics, Pose
from simulator.box_world.ray_kernel import Solids, cast_rays


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
            solids, np.ascontiguousarray(pose.position), np.ascontiguousarray(pose.rotation),
            (camera.fx, camera.fy), (camera.cx, camera.cy), (camera.height, camera.width),
            num_things,
        )  # fmt: skip
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

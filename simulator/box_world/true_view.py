"""How much of the volumes on and in furniture a camera truly has in view."""

from __future__ import annotations

import math

import numpy as np

from sgm.camera.pinhole import Pose
from sgm.layout.box import Box
from sgm.schema import RELATIONS
from simulator.box_world.depth_camera import DepthCamera
from simulator.box_world.ray_kernel import Solids, find_hidden
from simulator.box_world.world import BoxWorld

_TOUCHING = 0.005  # metres: points on the surface of other furniture count
NUM_POINTS = 2000  # of a volume, about: a share is right to .005 or so


class TrueView:
    """Tells which share of each volume was in view, by rays through the world.

    A point is in view if the image holds it, it is in reach, and nothing stands before it. Points
    inside other furniture do not count. They are points of its own, ten times as dense as those of
    a `LookBuilder`, so that it does not share what that one's points miss.

    Attributes:
        points: of the volumes, by (furniture, relation), (n, 3) each.
    """

    def __init__(
        self, world: BoxWorld, camera: DepthCamera, reach: tuple[float, float] = (0.2, 4.0)
    ) -> None:
        """Take the volumes of a world; `reach` is how near and far things are seen, metres."""
        self._world, self._camera, self._reach = world, camera, reach
        self.points: dict[tuple[int, str], np.ndarray] = {}
        rng = np.random.default_rng(0)
        for number, box in enumerate(world.floor.furniture):
            for relation in RELATIONS:
                points = sample_cells(box, relation, NUM_POINTS, rng=rng)
                for other in world.floor.furniture:
                    if other is not box:
                        outside = np.abs(other.to_own(points)) - np.array(other.size) / 2
                        points = points[outside.max(axis=1) > -_TOUCHING]
                if len(points):
                    self.points[number, relation] = points
        self._frames: list[tuple[float, Pose, Solids]] = []

    def clear(self) -> None:
        """Forget all frames."""
        self._frames.clear()

    def add(self, time: float, pose: Pose) -> None:
        """Add a frame of a time, seconds, and a true pose, in the world as it is now."""
        self._frames.append((time, pose, self._world.solids))

    def compute_coverage(
        self, furniture: int, relation: str, start: float = -math.inf, end: float = math.inf
    ) -> float:
        """Return the share of a volume that was in view in any frame from `start` to `end`.

        0 where there is no such volume, or no frame.
        """
        points = self.points.get((furniture, relation))
        if points is None:
            return 0.0
        is_seen = np.zeros(len(points), dtype=bool)
        for time, pose, solids in self._frames:
            if start <= time <= end and not is_seen.all():
                unseen = np.flatnonzero(~is_seen)
                is_seen[unseen] = self._find_seen(pose, solids, points[unseen])
        return float(is_seen.mean())

    def count_frames(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Return in how many frames from `start` to `end` each point (n, 3) was in view, (n,)."""
        counts = np.zeros(len(points), dtype=np.int64)
        for time, pose, solids in self._frames:
            if start <= time <= end:
                counts += self._find_seen(pose, solids, points)
        return counts

    def _find_seen(self, pose: Pose, solids: Solids, points: np.ndarray) -> np.ndarray:
        """Tell which points (n, 3) are in view, bool (n,)."""
        distance = np.linalg.norm(points - pose.position, axis=1)
        nearest, farthest = self._reach
        is_seen = (distance >= nearest) & (distance <= farthest)
        is_seen &= self._camera.shows(pose, points)
        rows = np.flatnonzero(is_seen)
        if len(rows):
            near = solids.select_between(pose.position, points[rows])
            is_seen[rows] = ~find_hidden(near, np.ascontiguousarray(pose.position), points[rows])
        return is_seen


def sample_cells(
    box: Box, relation: str, num_points: int, *, rng: np.random.Generator
) -> np.ndarray:
    """Return about so many points of the volume of a relation to a box, one in each of its cells.

    They lie in the part that can be looked at (`Box.shown_volume`).

    Args:
        box: the furniture.
        relation: such as "in" or "onTop".
        num_points: about n; cells are about cubes.
        rng: of where in its cell each point lies.

    Returns:
        (n, 3) in the map; (0, 3) where there is no such volume, as "in" a table.
    """
    volume = box.shown_volume(relation)
    if volume is None:
        return np.empty((0, 3))
    size = np.array(volume.size)
    counts = np.ceil(size / (size.prod() / num_points) ** (1 / 3)).astype(int)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    return volume.to_map(size * ((cells + rng.random(cells.shape)) / counts - 0.5))

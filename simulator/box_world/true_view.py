"""How much of the volumes on and in furniture a camera truly has in view."""

from __future__ import annotations

import numpy as np

from sgm.eyes.camera import Pose
from sgm.layout.box import sample_volume
from sgm.memory.sighting import RELATIONS
from simulator.box_world.depth_camera import DepthCamera
from simulator.box_world.world import BoxWorld

_TOUCHING = 0.005  # metres: points on the surface of other furniture count
NUM_POINTS = 500  # of a volume: a share is right to .02 or so


class TrueView:
    """Collects over frames which points of each volume were in view, by rays through the world.

    A point is in view if the image holds it, it is in reach, and nothing stands before it. Points
    inside other furniture do not count.

    Attributes:
        points: of the volumes, by (furniture, relation), (n, 3) each.
        is_seen: which of them were in view since the last `clear`, bool (n,) each.
    """

    def __init__(
        self, world: BoxWorld, camera: DepthCamera, reach: tuple[float, float] = (0.2, 4.0)
    ) -> None:
        """Take the volumes of a world.

        Args:
            world: of the furniture.
            camera: whose image counts.
            reach: nearest and farthest distance at which things are seen, metres.
        """
        self._world, self._camera, self._reach = world, camera, reach
        self.points: dict[tuple[int, str], np.ndarray] = {}
        for number, box in enumerate(world.floor.furniture):
            for relation in RELATIONS:
                points = sample_volume(box, relation, NUM_POINTS)
                for other in world.floor.furniture:
                    if other is not box:
                        outside = np.abs(other.to_own(points)) - np.array(other.size) / 2
                        points = points[outside.max(axis=1) > -_TOUCHING]
                if len(points):
                    self.points[number, relation] = points
        self._all = np.concatenate(list(self.points.values()))
        ends = np.cumsum([len(points) for points in self.points.values()])[:-1]
        self._ends = ends
        self.clear()

    def clear(self) -> None:
        """Forget what was in view."""
        self._is_seen = np.zeros(len(self._all), dtype=bool)

    def add(self, pose: Pose) -> None:
        """Add what a true pose of the camera has in view now."""
        distance = np.linalg.norm(self._all - pose.position, axis=1)
        nearest, farthest = self._reach
        is_possible = (distance >= nearest) & (distance <= farthest) & ~self._is_seen
        is_possible &= self._camera.shows(pose, self._all)
        possible = np.flatnonzero(is_possible)
        ignored = np.full(len(possible), -1, dtype=np.int32)
        world = self._world
        is_hidden = world.compute_hidden(world.solids, pose.position, self._all[possible], ignored)
        self._is_seen[possible[~is_hidden]] = True

    @property
    def is_seen(self) -> dict[tuple[int, str], np.ndarray]:
        """Which points of each volume were in view."""
        return dict(zip(self.points, np.split(self._is_seen, self._ends), strict=True))

    def compute_coverage(self, furniture: int, relation: str) -> float:
        """Return the share of a volume that was in view; 0 where there is no such volume."""
        seen = self.is_seen.get((furniture, relation))
        return 0.0 if seen is None else float(seen.mean())

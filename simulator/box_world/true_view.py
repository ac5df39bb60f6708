"""How much of the volumes on and in furniture a camera truly has in view."""

from __future__ import annotations

import numpy as np

from sgm.eyes.camera import Pose
from sgm.layout.box import sample_volume
from sgm.memory.sighting import RELATIONS
from simulator.box_world.depth_camera import DepthCamera
from simulator.box_world.world import BoxWorld

NUM_POINTS = 500  # of a volume: a share is right to .02 or so


class TrueView:
    """Collects over frames which points of each volume were in view, by rays through the world.

    A point is in view if image and range of the camera hold it and nothing stands before it.

    Attributes:
        points: of the volumes, by (furniture, relation), (n, 3) each.
        is_seen: which of them were in view since the last `clear`, bool (n,) each.
    """

    def __init__(self, world: BoxWorld, camera: DepthCamera) -> None:
        """Take the volumes of a world.

        Args:
            world: of the furniture.
            camera: whose image and range count.
        """
        self._world, self._camera = world, camera
        self.points: dict[tuple[int, str], np.ndarray] = {}
        for number, box in enumerate(world.floor.furniture):
            for relation in RELATIONS:
                points = sample_volume(box, relation, NUM_POINTS)
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
        possible = np.flatnonzero(self._camera.sees(pose, self._all) & ~self._is_seen)
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

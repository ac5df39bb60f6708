"""How much of the volumes on and in furniture a camera truly has in view."""

from __future__ import annotations

import math

import numpy as np

from sgm.eyes.camera import Pose
from sgm.layout.box import sample_volume
from sgm.memory.sighting import RELATIONS
from simulator.box_world.depth_camera import DepthCamera
from simulator.box_world.world import BoxWorld

_TOUCHING = 0.005  # metres: points on the surface of other furniture count
NUM_POINTS = 300  # of a volume: a share is right to .02 or so


class TrueView:
    """Notes for each frame which points of each volume were in view, by rays through the world.

    A point is in view if the image holds it, it is in reach, and nothing stands before it. Points
    inside other furniture do not count.

    Attributes:
        points: of the volumes, by (furniture, relation), (n, 3) each.
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
        ends = np.cumsum([len(points) for points in self.points.values()])
        self._rows = {
            volume: slice(end - len(points), end)
            for (volume, points), end in zip(self.points.items(), ends.tolist(), strict=True)
        }
        self.clear()

    def clear(self) -> None:
        """Forget all frames."""
        self._times: list[float] = []
        self._seen: list[np.ndarray] = []

    def add(self, time: float, pose: Pose) -> None:
        """Add what a true pose of the camera has in view now.

        Args:
            time: of the frame, seconds.
            pose: of the camera.
        """
        distance = np.linalg.norm(self._all - pose.position, axis=1)
        nearest, farthest = self._reach
        is_possible = (distance >= nearest) & (distance <= farthest)
        is_possible &= self._camera.shows(pose, self._all)
        possible = np.flatnonzero(is_possible)
        ignored = np.full(len(possible), -1, dtype=np.int32)
        world = self._world
        is_hidden = world.compute_hidden(world.solids, pose.position, self._all[possible], ignored)
        is_seen = np.zeros(len(self._all), dtype=bool)
        is_seen[possible[~is_hidden]] = True
        self._times.append(time)
        self._seen.append(is_seen)

    def compute_coverage(
        self,
        furniture: int,
        relation: str,
        start: float = -math.inf,
        end: float = math.inf,
    ) -> float:
        """Return the share of a volume that was in view in any frame from `start` to `end`.

        0 where there is no such volume, or no frame.
        """
        rows = self._rows.get((furniture, relation))
        seen = [
            is_seen[rows]
            for time, is_seen in zip(self._times, self._seen, strict=True)
            if rows is not None and start <= time <= end
        ]
        return float(np.any(seen, axis=0).mean()) if seen else 0.0

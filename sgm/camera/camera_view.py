"""What is in view of a camera in one frame, and what its depth image has measured."""

from __future__ import annotations

import math

import numpy as np

from sgm.camera.depth_image import DepthImage
from sgm.camera.pinhole import Intrinsics, Pose
from sgm.camera.scene import Scene, compute_entries
from sgm.layout.viewpoint import Viewpoint
from sgm.schema import IS_INSIDE, PlaceCode

# Metres of a ray within furniture, and behind it, from which on its depth contradicts the map.
_LEAST_CHORD, _MOST_BEHIND = 0.1, 0.2
_CONTRADICTED = 0.9  # share of the rays towards furniture that go through it where it is not


class CameraView:
    """One frame of a camera: which points are in view, and where the things of the image are.

    With a depth image, a point is in view if it is not behind what was measured; pixels without a
    measurement (0, nan) say nothing. Infinity means that nothing was in the way. Without a depth
    image boxes are solid, but for the open front of those that are open.

    Attributes:
        pose, intrinsics: of the camera.
        has_depth: whether there is a depth image.
    """

    def __init__(
        self,
        scene: Scene,
        pose: Pose,
        intrinsics: Intrinsics,
        depth: DepthImage | None,
        reach: tuple[float, float],
    ) -> None:
        """Look at a scene; `reach` is the nearest and farthest distance that things are seen at."""
        self.pose, self.intrinsics = pose, intrinsics
        self.has_depth = depth is not None
        self._scene, self._reach, self._depth = scene, reach, depth
        self._contradicted = np.zeros(len(scene.ids), dtype=bool)
        self._num_met = 0  # places that rays came to
        self._occluders = self._find_in_cone(scene.center, scene.radius, 0.0)

    def make_viewpoint(self) -> Viewpoint:
        """Return from where the frame was taken, as it is drawn on a floor plan."""
        left = math.atan((self.intrinsics.cx + 0.5) / self.intrinsics.fx)
        right = math.atan((self.intrinsics.width - 0.5 - self.intrinsics.cx) / self.intrinsics.fx)
        ahead = self.pose.rotation[:2, 2]
        if np.hypot(*ahead) < 1e-6:  # straight down: ahead is what is up in the image
            ahead = -self.pose.rotation[:2, 1]
        yaw = math.atan2(ahead[1], ahead[0]) + (left - right) / 2
        x, y, z = self.pose.position.tolist()
        return Viewpoint(x, y, z, yaw, left + right, self._reach[1])

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which points (n, 3) are in the image, hidden or not, bool (n,)."""
        return self.intrinsics.contains(self.intrinsics.project(self.pose.to_camera(points)))

    def find_seen_points(
        self, volumes: np.ndarray, margin: float, known: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Find the points of volumes (v,) that are in view, or `margin` metres behind what is.

        Returns:
            The volumes of which something may be in view, (k,), and how far each of their points
            is, as `compute_seen` says, (k, n); 0 for those that are `known`, (v, n).
        """
        scene = self._scene
        nearest, _ = self._reach
        is_near = self._find_in_cone(
            scene.volume_center[volumes], scene.volume_radius[volumes], nearest
        )
        volumes, known = volumes[is_near], known[is_near]
        share = np.zeros((len(volumes), scene.points.shape[1]))
        rows, columns = np.nonzero(scene.is_free[volumes] & ~known)
        if len(rows):
            points = scene.points[volumes[rows], columns]
            share[rows, columns] = self.compute_seen(points, margin, volumes[rows])
            share[self._contradicted[PlaceCode.furniture(volumes)]] = 0.0
        return volumes, share

    def compute_seen(self, points: np.ndarray, margin: float, volumes: np.ndarray) -> np.ndarray:
        """Return how far points (n, 3), each in a volume (n,), are in view: 0 to 1, (n,).

        By the four pixels around each point: 1 if what all of them measured is not in front of it,
        0 if it is for all of them or none measured. Between, where an edge passes, it is the share
        of those that show the point, the nearer ones more (as in bilinear interpolation). What was
        measured behind the furniture below a point says nothing (`_find_ends`).
        """
        pixels, away = self._project(points)
        rows = np.flatnonzero(away >= 0)  # in the image and in reach
        share = np.zeros(len(points))
        if self._depth is not None:
            most, is_solid = self._find_ends(points[rows], volumes[rows], away[rows])
            self._note_contradicted(self._depth.read(pixels[rows]), most, volumes[rows])
            most = np.where(is_solid, most, np.inf)
            share[rows] = self._depth.compute_share(pixels[rows], away[rows] - margin, most)
        elif len(rows):
            share[rows] = ~self._find_behind_boxes(points[rows], volumes[rows])
        return share

    @property
    def num_contradicted(self) -> int:
        """Number of places that nearly all rays towards what they bear or hold went through.

        They are not where the map says, or what was measured is wrong: none of their points counts.
        """
        return int(self._contradicted.sum())

    @property
    def is_contradicted(self) -> bool:
        """Whether rays went through places alone: then the image, the pose or the map is wrong."""
        return self._num_met > 0 and self.num_contradicted == self._num_met

    def _note_contradicted(
        self, measured: np.ndarray, most: np.ndarray, volumes: np.ndarray
    ) -> None:
        """Find the places in view that rays (n,) go through, by the z that they can measure."""
        num_places, places = len(self._scene.ids), PlaceCode.furniture(volumes)
        is_met = (measured > 0) & np.isfinite(most)
        is_through = is_met & (measured > most)
        if not self._scene.is_sure:  # it may be gone: something is seen where it was
            is_through &= np.isinf(measured)
        num_met = np.bincount(places[is_met], minlength=num_places)
        num_through = np.bincount(places[is_through], minlength=num_places)
        self._contradicted = num_through > _CONTRADICTED * num_met
        self._num_met = int((num_met > 0).sum())

    def _find_ends(
        self, points: np.ndarray, volumes: np.ndarray, away: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest z that the rays through points on or in furniture can measure, (n,).

        They end at the furniture: what is measured behind it contradicts the map. It is infinity
        where a ray meets too little of the box to tell, or the footprint is a polygon.

        Args:
            points: in the map, (n, 3).
            volumes: that they lie in, -1 for none, (n,).
            away: their z in the camera's frame, (n,).

        Returns:
            That z. Which rays come to the upper side of furniture that is there for sure, bool
            (n,): it is solid, while others may end at the back of a shelf, which need not have one.
        """
        scene, origin = self._scene, self.pose.position
        most, is_solid = np.full(len(points), np.inf), np.zeros(len(points), dtype=bool)
        if not len(scene.ids):
            return most, is_solid
        places = PlaceCode.furniture(volumes)
        start = np.einsum("pi,pij->pj", origin - scene.center, scene.rotation)  # (P, 3)
        rays = points - origin
        length = np.linalg.norm(rays, axis=1)
        # One axis after the other: numpy is slow along an axis of three.
        entry, leave = np.full(len(points), -np.inf), np.full(len(points), np.inf)
        for axis in range(3):
            way = rays[:, :2] * scene.rotation[:, :2, axis][places]
            along = way[:, 0] + way[:, 1] + rays[:, 2] * (axis == 2)
            along = np.where(np.abs(along) < 1e-12, 1e-12, along)
            to_low = (-scene.half - start)[places, axis] / along
            to_high = (scene.half - start)[places, axis] / along
            near = np.minimum(to_low, to_high)
            enters_above = near > entry  # of the last axis, which is up
            entry = np.maximum(entry, near)
            leave = np.minimum(leave, np.maximum(to_low, to_high))
        slack = 2 * self.pose.compute_sd(length)
        is_met = (entry > 0) & ((leave - entry) * length > _LEAST_CHORD + slack)
        is_met &= (volumes >= 0) & ~scene.has_outline[places]
        most[is_met] = ((leave + (_MOST_BEHIND + slack) / length) * away)[is_met]
        if scene.is_sure:
            is_above = start[:, 2] > scene.half[:, 2]
            is_solid = is_met & enters_above & is_above[places]
        return most, is_solid

    def measure_behind(self, points: np.ndarray, volumes: np.ndarray) -> np.ndarray:
        """Return how far the rays through points (n, 3) went on behind them, metres, (n,).

        Negative where something is in front of the point; nan where it is not in the image or in
        reach, nothing was measured, or that contradicts the map. Without a depth image infinite or
        minus infinite.
        """
        pixels, away = self._project(points)
        behind = np.full(len(points), np.nan)
        rows = np.flatnonzero(away >= 0)
        if self._depth is not None:
            measured = self._depth.read(pixels[rows])
            most, is_solid = self._find_ends(points[rows], volumes[rows], away[rows])
            is_known = (measured > 0) & ~(is_solid & (measured > most))
            behind[rows] = np.where(is_known, measured - away[rows], np.nan)
            scale = np.linalg.norm(points[rows] - self.pose.position, axis=1) / away[rows]
            behind[rows] *= scale  # along the ray
        elif len(rows):
            is_hidden = self._find_behind_boxes(points[rows], volumes[rows])
            behind[rows] = np.where(is_hidden, -np.inf, np.inf)
        return behind

    def measure_boxes(self, boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the depth of boxes in pixels (n, 4), nan for none, and its uncertainty, (n,)."""
        if self._depth is None or not len(boxes):
            return np.full(len(boxes), np.nan), np.zeros(len(boxes))
        return self._depth.measure_boxes(boxes, self._reach[1])

    def measure_pixels(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the point in the map that each pixel (n, 2) shows, and which pixels measured one.

        Returns:
            Points (n, 3). Which pixels measured one in reach, (n,). Which show what is out of
            reach, (n,).
        """
        if self._depth is None:
            nowhere = np.zeros(len(pixels), dtype=bool)
            return np.zeros((len(pixels), 3)), nowhere, nowhere.copy()
        depth = self._depth.read(pixels)
        is_known = (depth > 0) & np.isfinite(depth)
        camera = self.intrinsics.unproject(pixels, np.where(is_known, depth, 1.0))
        is_far = np.linalg.norm(camera, axis=1) > self._reach[1]
        is_beyond = (depth == np.inf) | (is_known & is_far)
        return self.pose.to_map(camera), is_known & ~is_far, is_beyond

    def _project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return pixels (n, 2), and z (n,), -1 for what is not in the image or in reach."""
        camera = self.pose.to_camera(points)
        pixels = self.intrinsics.project(camera)
        nearest, farthest = self._reach
        distance = np.linalg.norm(camera, axis=1)
        is_in = self.intrinsics.contains(pixels) & (distance >= nearest) & (distance <= farthest)
        return pixels, np.where(is_in, camera[:, 2], -1.0)

    def _find_behind_boxes(self, points: np.ndarray, volumes: np.ndarray) -> np.ndarray:
        """Tell which points (n, 3) of volumes (n,) are behind boxes or in them, bool (n,)."""
        scene, origin = self._scene, self.pose.position
        places = np.flatnonzero(self._occluders)
        entry, leave, axis = compute_entries(scene, origin, points - origin, places)
        in_the_way = (np.maximum(entry, 0) < leave) & (entry < 1 - 1e-9) & (leave > 0)
        # Into a box that is open one looks through its front alone.
        is_own = PlaceCode.furniture(volumes)[:, None] == places
        is_own &= IS_INSIDE[PlaceCode.relation(volumes)][:, None]
        start = scene.to_own(origin[None], places)[0, :, 0]
        is_front = (axis == 0) & (start > scene.half[places, 0])
        in_the_way &= ~(is_own & (is_front | (entry <= 0)))
        return np.any(in_the_way, axis=1)

    def _find_in_cone(self, center: np.ndarray, radius: np.ndarray, nearest: float) -> np.ndarray:
        """Tell which balls may reach into the image and the detector's reach, bool (n,)."""
        camera = self.pose.to_camera(center)
        distance = np.linalg.norm(camera, axis=1)
        inside = (distance - radius <= self._reach[1]) & (distance + radius >= nearest)
        for plane in _make_planes(self.intrinsics):
            inside &= camera @ plane >= -radius
        return inside


def _make_planes(intrinsics: Intrinsics) -> np.ndarray:
    """Return the normals of the sides of the image's cone, inwards, and forward, (5, 3)."""
    ends = np.array([[-0.5, -0.5], [intrinsics.width - 0.5, intrinsics.height - 0.5]])
    (left, top), (right, bottom) = intrinsics.unproject(ends, np.ones(2))[:, :2]
    planes = np.array(
        [[1, 0, -left], [-1, 0, right], [0, 1, -top], [0, -1, bottom], [0, 0, 1]], dtype=float
    )
    return planes / np.linalg.norm(planes, axis=1, keepdims=True)

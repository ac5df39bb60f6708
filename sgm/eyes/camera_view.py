"""What is in view of a camera in one frame, and what its depth image has measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sgm.eyes.camera import Intrinsics, Pose
from sgm.eyes.scene import Scene, compute_entries
from sgm.layout.viewpoint import Viewpoint
from sgm.schema import IS_INSIDE, PlaceCode

_FARTHEST_METRES = 200.0  # no depth camera of a home measures more: these are other units
# Of the four pixels around a point, that measured: one of them, where it is between all four.
_LEAST_WEIGHT = 0.25
_PATCH = np.linspace(-0.2, 0.2, 5)  # of the sides of a box in pixels, around its middle
_BESIDE = np.array([-1.0, 0.0, 1.0])  # pixels around the middle by which a box may be wrong


class DepthImage:
    """Depths z of all pixels.

    0 and nan say that nothing was measured, infinity that nothing was in the way.
    """

    def __init__(self, depth: Any, intrinsics: Intrinsics) -> None:
        """Take an image in metres, or in millimetres if they are whole numbers, (height, width).

        Raises:
            ValueError: if it is none, or has another size than the camera.
        """
        read = np.asarray(depth)
        size = (intrinsics.height, intrinsics.width)
        if read.shape != size or read.dtype.kind not in "fui":
            raise ValueError(
                f"depth must be numbers of shape {size}, as the intrinsics say, got "
                f"{read.dtype} of shape {read.shape}. Register it to the camera of the detections."
            )
        self._depth = read / 1000 if read.dtype.kind in "ui" else read

    def compute_share(self, pixels: np.ndarray, away: np.ndarray) -> np.ndarray:
        """Return the weight of the pixels around (n, 2) that measured at least z (n,), (n,)."""
        height, width = self._depth.shape
        corner = np.floor(pixels).astype(int)
        right, down = (pixels - corner).T
        at_left, at_top = np.maximum(corner, 0).T
        at_right = np.minimum(corner[:, 0] + 1, width - 1)
        at_bottom = np.minimum(corner[:, 1] + 1, height - 1)
        shown, known = np.zeros((2, len(pixels)))
        for column, across in ((at_left, 1 - right), (at_right, right)):
            for row, along in ((at_top, 1 - down), (at_bottom, down)):
                depth, weight = self._depth[row, column], across * along
                _check_unit(depth)
                known += weight * (depth > 0)  # nan and 0 are none
                shown += weight * (depth >= away) * (depth > 0)
        return np.where(known > _LEAST_WEIGHT, shown / np.maximum(known, _LEAST_WEIGHT), 0.0)

    def read(self, pixels: np.ndarray) -> np.ndarray:
        """Return the depth at pixels (n, 2), -inf where nothing was measured, (n,)."""
        columns, rows = self._round(pixels)
        depth = self._depth[rows, columns]
        depth = np.where(depth > 0, depth, -np.inf)  # nan, too
        _check_unit(depth)
        return depth

    def measure_boxes(self, boxes: np.ndarray, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the depth in the middle of boxes in pixels (n, 4), and its uncertainty, (n,) each.

        The depth is the median of a patch of 5 x 5 pixels over the inner part of each box, nan
        where there is none. Boxes are right to a pixel or so: the standard deviation is half the
        range of what was measured a pixel beside the middle. Of what is smaller than that, or is
        seen at a flat angle, a pixel away is another depth. What is farther counts as `farthest`.
        """
        middle, side = (boxes[:, :2] + boxes[:, 2:]) / 2, boxes[:, 2:] - boxes[:, :2]
        patch = self._read_patches(middle[:, None] + side[:, None] * _PATCH[:, None])
        is_known = np.isfinite(patch) & (patch > 0)
        # Sorted with those unknown at the end; np.nanmedian does the same in ten times the time.
        patch = np.sort(np.where(is_known, patch, np.inf), axis=1)
        number, row = is_known.sum(axis=1), np.arange(len(boxes))
        low, high = patch[row, np.maximum(number - 1, 0) // 2], patch[row, number // 2 % 25]

        beside = self._read_patches(middle[:, None] + _BESIDE[:, None])
        beside = np.minimum(np.where(beside > 0, beside, np.nan), farthest)
        nearest, last = np.fmin.reduce(beside, axis=1), np.fmax.reduce(beside, axis=1)
        sd = np.where(nearest <= last, last - nearest, 0) / 2  # nan if none was measured
        return np.where(number > 0, (low + high) / 2, np.nan), sd

    def _read_patches(self, pixels: np.ndarray) -> np.ndarray:
        """Return the depths of the m x m pixels in columns and rows (n, m, 2), (n, m * m)."""
        columns, rows = self._round(pixels)
        return self._depth[rows[:, :, None], columns[:, None, :]].reshape(len(pixels), -1)

    def _round(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return columns and rows of the pixels of the image that are nearest to (..., 2)."""
        height, width = self._depth.shape
        columns, rows = (np.rint(pixels[..., side]).astype(int) for side in (0, 1))
        return np.clip(columns, 0, width - 1), np.clip(rows, 0, height - 1)


def _check_unit(depth: np.ndarray) -> None:
    """Check that no depth of a home is measured beyond what homes have; `ValueError` if one is."""
    if np.any((depth > _FARTHEST_METRES) & np.isfinite(depth)):
        raise ValueError(
            f"depth must be at most {_FARTHEST_METRES:g} m, got "
            f"{depth[np.isfinite(depth)].max():g}. Give metres, or millimetres as integers."
        )


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
        return volumes, share

    def compute_seen(self, points: np.ndarray, margin: float, volumes: np.ndarray) -> np.ndarray:
        """Return how far points (n, 3), each in a volume (n,), are in view: 0 to 1, (n,).

        By the four pixels around each point: 1 if what all of them measured is not in front of it,
        0 if it is for all of them or none measured. Between, where an edge passes, it is the share
        of those that show the point, the nearer ones more (as in bilinear interpolation).
        """
        pixels, away = self._project(points)
        rows = np.flatnonzero(away >= 0)  # in the image and in reach
        share = np.zeros(len(points))
        if self._depth is not None:
            share[rows] = self._depth.compute_share(pixels[rows], away[rows] - margin)
        elif len(rows):
            share[rows] = ~self._find_behind_boxes(points[rows], volumes[rows])
        return share

    def measure_behind(self, points: np.ndarray, volumes: np.ndarray) -> np.ndarray:
        """Return how far the rays through points (n, 3) went on behind them, metres, (n,).

        Negative where something is in front of the point; nan where it is not in the image or in
        reach, or nothing was measured. Without a depth image infinite or minus infinite.
        """
        pixels, away = self._project(points)
        behind = np.full(len(points), np.nan)
        rows = np.flatnonzero(away >= 0)
        if self._depth is not None:
            measured = self._depth.read(pixels[rows])
            behind[rows] = np.where(measured > 0, measured - away[rows], np.nan)
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

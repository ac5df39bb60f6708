"""Small scenes of boxes, rendered by casting a ray through every pixel."""

from functools import lru_cache

import numpy as np

from sgm.eyes import ABOVE_TOP, Box, Detection, Intrinsics, Pose

CAMERA = Intrinsics(140.0, 140.0, 79.5, 59.5, 160, 120)
TABLE = Box((2.0, 0.0, 0.35), (0.8, 1.2, 0.7))
FLOOR = Box.of_floor((-3, -3), (5, 3))


def make_shelf(center, size, yaw=0.0, board=0.02):
    """A box that is open in front, and the boxes of its back, sides and three boards."""
    outer = Box(center, size, yaw, "open")
    length, width, height = size
    parts = [
        ((-(length - board) / 2, 0, 0), (board, width, height)),
        ((0, (width - board) / 2, 0), (length, board, height)),
        ((0, -(width - board) / 2, 0), (length, board, height)),
        ((0, 0, (height - board) / 2), (length, width, board)),
        ((0, 0, -(height - board) / 2), (length, width, board)),
        ((0, 0, 0), (length, width, board)),
    ]
    solid = [Box(tuple(outer.to_map(np.array(at))), sides, yaw) for at, sides in parts]
    return outer, solid


def cast(solid, origin, directions):
    """Distance to the first box along rays (n, 3), in lengths of the directions; inf for none."""
    first = np.full(len(directions), np.inf)
    columns = np.ascontiguousarray(directions.T)  # (3, n): numpy is slow along axes of three
    for box in solid:
        start = box.to_own(origin[None]).T  # (3, 1)
        along = box.to_own(np.eye(3) + box.center).T @ columns
        along[np.abs(along) < 1e-12] = 1e-12
        half = np.array(box.size)[:, None] / 2
        near, far = (-half - start) / along, (half - start) / along
        entry = np.minimum(near, far).max(axis=0)
        leave = np.maximum(near, far).min(axis=0)
        hits = (entry <= leave) & (leave > 0)
        np.minimum(first, np.maximum(entry, 0), out=first, where=hits)
    return first


@lru_cache(maxsize=4)
def list_rays(camera):
    """Directions of all pixels in the camera's frame, of depth 1."""
    column, row = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    pixels = np.column_stack([column.ravel(), row.ravel()])
    rays = camera.unproject(pixels, np.ones(len(pixels)))
    rays.setflags(write=False)
    return rays


def render(solid, pose, camera=CAMERA):
    """A depth image, inf where no box is."""
    depth = cast(solid, pose.position, list_rays(camera) @ pose.rotation.T)
    return depth.reshape(camera.height, camera.width)


def compute_true_share(box, relation, solid, poses, camera=CAMERA, farthest=4.0, others=()):
    """Share of a volume that some pose shows, by rays to 8,000 random points of it."""
    volume = box.volume(relation)
    share = np.random.default_rng(0).random((8000, 3))
    if relation == "onTop":  # from the upper side on
        share[:, 2] = 1 - share[:, 2] * ABOVE_TOP / volume.size[2]
    points = volume.to_map((share - 0.5) * volume.size)
    for other in others:
        points = points[~other.contains(points)]
    seen = np.zeros(len(points), dtype=bool)
    for pose in poses:
        inside = camera.contains(camera.project(pose.to_camera(points)))
        rays = points - pose.position
        near = np.linalg.norm(rays, axis=1) <= farthest
        seen |= inside & near & (cast(solid, pose.position, rays) >= 1 - 1e-6)
    return seen.mean()


def detect(name, thing, pose, camera=CAMERA, score=0.9, **more):
    """The detection of a box in the image, not hidden."""
    corners = np.vstack(
        [np.column_stack([thing.corners, np.full(4, z)]) for z in (thing.bottom, thing.top)]
    )
    pixels = camera.project(pose.to_camera(corners))
    box = (*pixels.min(axis=0), *pixels.max(axis=0))
    return Detection(name, score, box, **more)


def put_on(box, x, y, size=(0.07, 0.07, 0.1)):
    """A thing on a box, at own coordinates x, y."""
    at = box.to_map(np.array([x, y, box.size[2] / 2 + size[2] / 2]))
    return Box(tuple(at), size)


def look_around(target, radius=1.6, height=1.4, num=30, turn=1.0, start=np.pi):
    """Poses on an arc around a target, which they look at, 20 s of a walk."""
    angles = start + np.linspace(-turn / 2, turn / 2, num)
    at = np.array(target)[:2] + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return [Pose.look_at((x, y, height), target) for x, y in at]

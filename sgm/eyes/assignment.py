"""Which piece of furniture a detected thing is in or on."""

from __future__ import annotations

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import Detection
from sgm.eyes.located import Located, Measured
from sgm.eyes.scene import Scene, compute_entries
from sgm.layout.box import ABOVE_TOP, BELOW_TOP
from sgm.layout.outline import compute_outline_distance

NOWHERE = -1
_IN_SIGHT = 2.0  # standard deviations of the pose by which volumes are dilated
_LEAST_HEIGHT = 0.01  # metres


def assign(scene: Scene, located: Located, dilation: float) -> np.ndarray:
    """Return the volume that each of k things lies in, -1 for none, (k,).

    Volumes are dilated by `dilation` and twice the standard deviation of the thing. Of those that
    contain all of it or its middle, the one is taken whose supporting surface is nearest to the
    lower side of the thing; inside there may be a board at any height. Of equally near ones, the
    one whose middle is nearest. `dilation` is in metres.
    """
    volumes = scene.list_volumes()
    if not len(volumes) or not len(located.detections):
        return np.full(len(located.detections), NOWHERE)
    places, is_top = volumes // 2, volumes % 2 == 1
    offset = located.center[:, None] - scene.volume_center[volumes]
    own = np.einsum("kvi,vij->kvj", offset, scene.rotation[places])
    outside = np.maximum(np.abs(own) - scene.volume_half[volumes], 0)
    beside = np.hypot(outside[..., 0], outside[..., 1])  # (k, v)
    for column, place in enumerate(places.tolist()):
        if place in scene.outlines:
            flat = own[:, column, :2]
            beside[:, column] = compute_outline_distance(scene.outlines[place], flat)
    allowed = dilation + _IN_SIGHT * located.sd[:, None]
    bottom, height = located.bottom[:, None], located.height[:, None]

    above = bottom - (scene.center + scene.half)[places, 2]  # of the upper side
    is_on = (above >= -BELOW_TOP - allowed) & (above <= ABOVE_TOP + allowed)
    lowest = (scene.volume_center - scene.volume_half)[volumes, 2]
    highest = np.maximum((scene.volume_center + scene.volume_half)[volumes, 2], lowest + height)
    beyond = np.maximum(np.maximum(lowest - bottom, bottom + height - highest), 0)
    gap = np.where(is_top, np.abs(above), beyond)
    fits = np.where(is_top, is_on, np.hypot(beside, beyond) <= allowed) & (beside <= allowed)
    # How high a thing is that lies along the ray is only guessed: its middle alone will do.
    fits |= np.hypot(beside, outside[..., 2]) <= allowed
    cost = np.where(fits, np.hypot(gap, beside), np.inf)
    cost += 1e-6 * np.linalg.norm(offset, axis=2)
    best = cost.argmin(axis=1)
    return np.where(np.isfinite(cost.min(axis=1)), volumes[best], NOWHERE)


def assign_by_ray(
    scene: Scene, view: CameraView, detection: Detection, dilation: float, farthest: float
) -> tuple[int, Measured]:
    """Return the volume of a thing without a depth, -1 for none, and where it stands.

    The ray through the lower side of its box ends on the surface that it stands on: the first box
    that it meets. Through an upper side that is on top, from `dilation` metres below it on; through
    the open front it is inside. Things are seen up to the distance `farthest`, in metres.
    """
    assert detection.box is not None
    left, top, right, bottom = detection.box
    pixel = np.array([[(left + right) / 2, bottom]])
    ray = view.pose.to_map(view.intrinsics.unproject(pixel, np.ones(1))) - view.pose.position
    ray /= np.linalg.norm(ray)
    places = np.arange(len(scene.ids))
    entry, leave, axis = (
        rows[0] for rows in compute_entries(scene, view.pose.position, ray, places)
    )
    meets = (entry < leave) & (entry > 0) & (entry <= farthest)
    if not meets.any():
        return NOWHERE, Measured(np.full(3, np.nan), 0.0, 0.0, 0.0)
    place = int(np.where(meets, entry, np.inf).argmin())
    away = float(entry[place])
    height = max((bottom - top) * away / view.intrinsics.fy, _LEAST_HEIGHT)
    radius = (right - left) * away / view.intrinsics.fx / 2
    foot, sd = view.pose.position + ray[0] * away, float(view.pose.compute_sd(entry[place]))
    at = Measured(foot + np.array([0.0, 0.0, height / 2]), radius, height, sd)

    upper = scene.center[place, 2] + scene.half[place, 2]
    if foot[2] > upper - BELOW_TOP - dilation - _IN_SIGHT * sd:
        return 2 * place + 1, at
    start = scene.to_own(view.pose.position[None], np.array([place]))[0, 0, 0]
    is_front = axis[place] == 0 and start > scene.half[place, 0]
    if scene.has_inside[place] and scene.is_open[place] and is_front:
        return 2 * place, at
    return NOWHERE, at

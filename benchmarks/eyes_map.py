"""How many frames a second a `LookBuilder` takes that draws its map, on one core.

The camera stands before a hall of 60 pieces of furniture of six labels, that are on no map, and
turns to and fro. A frame has a depth image of 640 x 480 pixels, 20 detections of things, and one of
every piece of furniture that it shows 50 pixels of, or of the nearest 12 alone. Seconds are
processor time of the process; the map is settled every ten seconds of the robot, and looks are
made.

Of a detection of furniture 484 pixels are read, and each of its points inside is compared with the
boxes of its label that are near.
"""

from __future__ import annotations

import time

import numpy as np
from _measure import Benchmark, Measure, run
from eyes import make_boxes

from sgm import PriorGraph, SceneGraphMemory
from sgm.eyes import Detection, FurnitureMapper, Gate, Intrinsics, LookBuilder, Pose
from simulator.box_world.ray_kernel import Solids, cast_rays

_CAMERA = Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480)
_LABELS = ("table", "shelf", "sofa", "bed", "counter", "desk")
_LEAST_PIXELS = 50
_FARTHEST = 15.0  # metres, so that all furniture is in reach
_TURN = 0.01  # radians from one picture to the next


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Render the pictures of one turn of the head, from places along 20 cm."""
    boxes = list(make_boxes().values())
    labels = [_LABELS[number % len(_LABELS)] for number in range(len(boxes))]
    solids = Solids.join([Solids.of_boxes([box], number) for number, box in enumerate(boxes)])
    prior = PriorGraph.household()
    rng = np.random.default_rng(0)
    poses, pictures = [], []
    for number in range(20):
        angle, aside = 0.5 + _TURN * (number - 10), 0.01 * number
        eye = np.array([-7.5 + aside, -5.5, 1.8])
        pose = Pose.look_at(eye, eye + np.array([np.cos(angle), np.sin(angle), -0.3]))
        depth, owner, _ = cast_rays(
            solids,
            pose.position,
            np.ascontiguousarray(pose.rotation),
            (_CAMERA.fx, _CAMERA.fy),
            (_CAMERA.cx, _CAMERA.cy),
            (_CAMERA.height, _CAMERA.width),
            len(boxes),
        )
        poses.append(pose)
        corner = rng.uniform((0, 0), (560, 400), (20, 2))
        things = [
            Detection(f"thing {n % 10}", 0.8, (*box_corner, *(box_corner + 60)))
            for n, box_corner in enumerate(corner)
        ]
        pictures.append((depth.astype(np.float32), things, _detect(owner, depth, labels)))

    def measure() -> tuple[float, dict[str, float]]:
        rates = {}
        for most in (len(boxes), 12):
            memory = SceneGraphMemory(prior)
            builder = LookBuilder(discover=FurnitureMapper(memory), gate=Gate(farthest=_FARTHEST))
            num_frames, num_detected = (1 if tiny else 30) * len(poses), 0
            to_and_fro = [*range(len(poses)), *reversed(range(len(poses)))]
            start = time.process_time()
            for number in range(num_frames):
                turn = to_and_fro[number % len(to_and_fro)]
                depth, things, furniture = pictures[turn]
                found = [*things, *furniture[:most]]
                num_detected += len(found) - len(things)
                assert builder.frame(number / 30, poses[turn], _CAMERA, found, depth), (
                    builder.counts
                )
            assert list(builder.finish())
            each = num_detected / num_frames
            rates[f"{each:.0f} of furniture"] = num_frames / (time.process_time() - start)
        return min(rates.values()), rates

    return measure, f"60 places, {len(poses)} pictures, 20 detections of things each"


def _detect(owner: np.ndarray, depth: np.ndarray, labels: list[str]) -> list[Detection]:
    """Return the detections of furniture that a picture shows, the nearest first."""
    counts = np.bincount(owner[owner >= 0], minlength=len(labels))
    found = []
    for number in np.flatnonzero(counts >= _LEAST_PIXELS).tolist():
        rows, columns = np.nonzero(owner == number)
        box = tuple(float(end) for end in (columns.min(), rows.min(), columns.max(), rows.max()))
        found.append((float(depth[rows, columns].min()), Detection(labels[number], 0.9, box)))
    return [detection for _, detection in sorted(found, key=lambda pair: pair[0])]


if __name__ == "__main__":
    run(Benchmark("frames of a camera that draw a map", "frames/s", 30), prepare, repeats=3)

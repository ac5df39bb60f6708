"""What messages of ROS 2 say, read by the names of their fields.

Any object with these fields will do: a message of `rclpy`, of `rosbags`, or of a test.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sgm.eyes.camera import Intrinsics, make_rotation
from sgm.eyes.detection import Detection
from sgm.messages import shorten

# What class ids of a detector mean, by number or text; None if they are names.
ClassNames = Sequence[str] | Mapping[str, str] | None
# Encodings of depth images: type of the numbers, and how many of them are a metre.
_ENCODINGS: Mapping[str, tuple[str, float]] = {
    "16UC1": ("u2", 1000.0), "mono16": ("u2", 1000.0), "32FC1": ("f4", 1.0),
}  # fmt: skip
_MOST_PIXELS = 1 << 25  # of a depth image: 8K is less
MOST_DETECTIONS = 1000  # of a frame


def read_time(header: Any) -> float:
    """Return the stamp of a header in seconds."""
    return float(header.stamp.sec) + float(header.stamp.nanosec) * 1e-9


def read_camera_info(message: Any) -> Intrinsics:
    """Return the intrinsics of a `sensor_msgs/CameraInfo`, whose image must be rectified."""
    matrix = [float(value) for value in message.k]
    return Intrinsics.from_matrix(matrix, int(message.width), int(message.height))


def read_depth_image(message: Any) -> np.ndarray:
    """Return the depth in metres of a `sensor_msgs/Image`, 0 where there is none, (height, width).

    Raises:
        ValueError: if the encoding is none of depth, or the message has less data than it says.
    """
    height, width, step = int(message.height), int(message.width), int(message.step)
    known = _ENCODINGS.get(str(message.encoding))
    if known is None:
        raise ValueError(
            f"depth image must be encoded as one of {', '.join(_ENCODINGS)}, got "
            f"{shorten(message.encoding)}. Name the topic of the depth image."
        )
    kind, per_metre = known
    if not 0 < height * width <= _MOST_PIXELS or height < 1 or step < width * int(kind[1]):
        raise ValueError(
            f"depth image must have 1 to {_MOST_PIXELS} pixels in rows of at least their size, got "
            f"{width} x {height} in rows of {step} bytes. Check the driver."
        )
    data = np.frombuffer(message.data, dtype=np.uint8)
    if len(data) < height * step:
        raise ValueError(
            f"depth image must have {height * step} bytes, got {len(data)}. It was cut short."
        )
    rows = data[: height * step].reshape(height, step)[:, : width * int(kind[1])]
    order = ">" if message.is_bigendian else "<"
    depth = np.ascontiguousarray(rows).view(f"{order}{kind}").astype(np.float32)
    return depth / np.float32(per_metre)


def read_detections(message: Any, names: ClassNames = None) -> list[Detection]:
    """Return the detections of a `vision_msgs/Detection2DArray`, boxes in pixels.

    Of each, the best of its results. Too many raise ValueError.
    """
    found = []
    for one in _list_detections(message):
        best = _find_best(one, names)
        x, y = float(one.bbox.center.position.x), float(one.bbox.center.position.y)
        half = (abs(float(one.bbox.size_x)) / 2, abs(float(one.bbox.size_y)) / 2)
        box = (x - half[0], y - half[1], x + half[0], y + half[1])
        if best is not None and all(map(math.isfinite, box)):
            found.append(Detection(*best, box=box, track=_read_track(one)))
    return found


def read_detections_3d(
    message: Any, to_map: np.ndarray, names: ClassNames = None
) -> list[Detection]:
    """Return the detections of a `vision_msgs/Detection3DArray`, centers in the map.

    `to_map` leads there from the coordinates of the header, (4, 4); all else as `read_detections`.
    """
    found = []
    for one in _list_detections(message):
        best = _find_best(one, names)
        at, size = one.bbox.center.position, one.bbox.size
        center = to_map @ (float(at.x), float(at.y), float(at.z), 1.0)
        sides = _turn_sides(one.bbox, to_map) if best is not None else np.zeros(3)
        is_known = min(float(size.x), float(size.y), float(size.z)) > 0
        if best is None or not np.isfinite(center).all() or not np.isfinite(sides).all():
            continue
        x, y, z = center[:3].tolist()
        own = tuple(sides.tolist()) if is_known else None
        found.append(Detection(*best, center=(x, y, z), size=own, track=_read_track(one)))
    return found


def read_uncertainty(covariance: Sequence[float]) -> tuple[float, float]:
    """Return the standard deviations of position and yaw of a covariance of ROS, (36,)."""
    values = np.asarray(covariance, dtype=float).ravel()
    if len(values) != 36 or not np.isfinite(values).all():
        raise ValueError(
            f"covariance must be 36 finite numbers, got {len(values)}. Check the localisation."
        )
    diagonal = np.maximum(values.reshape(6, 6).diagonal(), 0)
    return math.sqrt(diagonal[:2].max()), math.sqrt(diagonal[5])


def _list_detections(message: Any) -> Sequence[Any]:
    if len(message.detections) > MOST_DETECTIONS:
        raise ValueError(
            f"detections of a frame must be at most {MOST_DETECTIONS}, got "
            f"{len(message.detections)}. Raise the threshold of the detector."
        )
    return message.detections


def _find_best(detection: Any, names: ClassNames) -> tuple[str, float] | None:
    """Return name and score of the best hypothesis; None if there is none with a name."""
    hypotheses = [result.hypothesis for result in detection.results]
    if not hypotheses:
        return None
    best = max(hypotheses, key=lambda one: float(one.score))
    name, score = str(best.class_id), float(best.score)
    if names is not None:
        if isinstance(names, Mapping):
            name = names.get(name, name)
        elif name.isdecimal() and int(name) < len(names):
            name = names[int(name)]
    name = name.replace("_", " ").strip()
    if not name or len(name) > 200 or not math.isfinite(score):
        return None
    return name, min(max(score, 0.0), 1.0)


def _read_track(detection: Any) -> str | None:
    """Return the number of the thing over frames, where the detector has any."""
    text = str(getattr(detection, "id", "") or "")
    return text or None


def _turn_sides(bbox: Any, to_map: np.ndarray) -> np.ndarray:
    """Return the sides, along the axes of the map, of the box around a turned box, (3,)."""
    turn, size = bbox.center.orientation, bbox.size
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w], dtype=float)
    norm = np.linalg.norm(quaternion)
    own = make_rotation(quaternion / norm) if norm > 1e-6 else np.eye(3)
    sides = np.array([size.x, size.y, size.z], dtype=float)
    return np.abs(to_map[:3, :3] @ own) @ np.abs(sides)

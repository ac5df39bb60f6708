"""What messages of ROS 2 say, read by the names of their fields.

Any object with these fields will do: a message of `rclpy`, of `rosbags`, or of a test.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sgm.camera.detection import Detection
from sgm.camera.pinhole import Intrinsics, make_rotation
from sgm.messages import shorten
from sgm.names.words import MAX_LENGTH
from sgm.ros.compressed_depth import MOST_PIXELS, read_compressed_depth

# What class ids of a detector mean, by number or text; None if they are names.
ClassNames = Sequence[str] | Mapping[str, str] | None
ToMap = Callable[[str], np.ndarray | None]
# Encodings of depth images: type of the numbers, and how many of them are a metre.
_ENCODINGS: Mapping[str, tuple[str, float]] = {
    "16UC1": ("u2", 1000.0),
    "mono16": ("u2", 1000.0),
    "32FC1": ("f4", 1.0),
}
MOST_DETECTIONS = 1000  # of a frame


def read_time(header: Any) -> float:
    """Return the stamp of a header in seconds."""
    return float(header.stamp.sec) + float(header.stamp.nanosec) * 1e-9


def read_camera_info(message: Any) -> Intrinsics:
    """Return the intrinsics of a `sensor_msgs/CameraInfo`, whose image must be rectified."""
    matrix = [float(value) for value in message.k]
    return Intrinsics.from_matrix(matrix, int(message.width), int(message.height))


def read_depth_image(message: Any) -> np.ndarray:
    """Return the depth in metres, 0 or nan where there is none, (height, width).

    Read are a `sensor_msgs/Image`, and a `sensor_msgs/CompressedImage` of compressed depth as PNG.

    Raises:
        ValueError: if the encoding is none of depth, or the message has less data than it says.
        ModuleNotFoundError: if it is compressed, and Pillow is not installed.
    """
    if hasattr(message, "format"):
        return read_compressed_depth(str(message.format), message.data)
    height, width, step = int(message.height), int(message.width), int(message.step)
    known = _ENCODINGS.get(str(message.encoding))
    if known is None:
        raise ValueError(
            f"depth image must be encoded as one of {', '.join(_ENCODINGS)}, got "
            f"{shorten(message.encoding)}. Name the topic of the depth image."
        )
    kind, per_metre = known
    if not 0 < height * width <= MOST_PIXELS or height < 1 or step < width * int(kind[1]):
        raise ValueError(
            f"depth image must have 1 to {MOST_PIXELS} pixels in rows of at least their size, got "
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


def read_detections(
    message: Any,
    names: ClassNames = None,
    to_map: ToMap = lambda frame: None,
    on_drop: Callable[[str], None] = lambda why: None,
) -> list[Detection]:
    """Return the detections of a message: boxes in pixels, or centers in the map.

    Read are `vision_msgs/Detection2DArray` and `Detection3DArray`, of each detection the best of
    its results, and `yolo_msgs/DetectionArray`, whose boxes in space count where they have a size.

    Args:
        message: the array.
        names: what class ids of the detector mean; None if they are names.
        to_map: gives the matrix (4, 4) to the map from a frame of coordinates by its name, None
            where it is unknown; a box in space in such a frame is left out.
        on_drop: called for every detection that is left out, with the reason.

    Raises:
        ValueError: if there are more than `MOST_DETECTIONS`.
    """
    if len(message.detections) > MOST_DETECTIONS:
        raise ValueError(
            f"detections of a frame must be at most {MOST_DETECTIONS}, got "
            f"{len(message.detections)}. Raise the threshold of the detector."
        )
    found = []
    for detection in message.detections:
        best, (bounds, frame) = _find_best(detection, names), _find_bounds_3d(detection, message)
        if best is None:
            on_drop("detections without a name or a score")
            continue
        place = (
            _read_bounds(detection.bbox) if bounds is None else _move_bounds(bounds, to_map(frame))
        )
        if place is None:
            on_drop("detections whose box is unknown")
            continue
        found.append(Detection(*best, **place, track=_read_track(detection)))
    return found


def list_frames(message: Any) -> set[str]:
    """Return the names of the frames in which boxes in space of a message are."""
    found = (
        _find_bounds_3d(detection, message) for detection in message.detections[:MOST_DETECTIONS]
    )
    return {frame for bounds, frame in found if bounds is not None}


def _find_bounds_3d(detection: Any, message: Any) -> tuple[Any, str]:
    """Return the box in space of a detection and the frame that it is in; None for none."""
    bounds, frame = detection.bbox, str(message.header.frame_id)
    if hasattr(bounds, "size_x"):
        return None, frame
    if hasattr(detection, "bbox3d"):  # yolo_msgs: empty unless its depth was known
        bounds = detection.bbox3d
        sides = bounds.size.x, bounds.size.y, bounds.size.z
        frame = str(getattr(bounds, "frame_id", "")) or frame
        return (bounds if min(map(float, sides)) > 0 else None), frame
    return bounds, frame


def _read_bounds(bounds: Any) -> dict[str, Any] | None:
    """Return the box in pixels of a `BoundingBox2D`; None if it is not finite."""
    x, y = float(bounds.center.position.x), float(bounds.center.position.y)
    if hasattr(bounds, "size_x"):
        sides = float(bounds.size_x), float(bounds.size_y)
    else:
        sides = float(bounds.size.x), float(bounds.size.y)
    half = abs(sides[0]) / 2, abs(sides[1]) / 2
    box = (x - half[0], y - half[1], x + half[0], y + half[1])
    return {"box": box} if all(map(math.isfinite, box)) else None


def _move_bounds(bounds: Any, to_map: np.ndarray | None) -> dict[str, Any] | None:
    """Return center and sides in the map of a `BoundingBox3D`; None if they are unknown."""
    if to_map is None:
        return None
    position, size = bounds.center.position, bounds.size
    center = to_map @ (float(position.x), float(position.y), float(position.z), 1.0)
    sides = _turn_sides(bounds, to_map)
    if not np.isfinite(center).all() or not np.isfinite(sides).all():
        return None
    is_known = min(float(size.x), float(size.y), float(size.z)) > 0
    return {
        "center": tuple(center[:3].tolist()),
        "size": tuple(sides.tolist()) if is_known else None,
    }


def read_uncertainty(covariance: Sequence[float] | np.ndarray) -> tuple[float, float]:
    """Return the standard deviations of position and yaw of a covariance of ROS, (36,)."""
    values = np.asarray(covariance, dtype=float).ravel()
    if len(values) != 36 or not np.isfinite(values).all():
        raise ValueError(
            f"covariance must be 36 finite numbers, got {len(values)}. Check the localisation."
        )
    diagonal = np.maximum(values.reshape(6, 6).diagonal(), 0)
    return math.sqrt(diagonal[:2].max()), math.sqrt(diagonal[5])


def _find_best(detection: Any, names: ClassNames) -> tuple[str, float] | None:
    """Return name and score of the best hypothesis; None if there is none with a name."""
    if hasattr(detection, "class_name"):  # yolo_msgs
        name, score = str(detection.class_name or detection.class_id), float(detection.score)
    else:
        hypotheses = [result.hypothesis for result in detection.results]
        if not hypotheses:
            return None
        best = max(hypotheses, key=lambda hypothesis: float(hypothesis.score))
        name, score = str(best.class_id), float(best.score)
    if names is not None:
        if isinstance(names, Mapping):
            name = names.get(name, name)
        elif name.isdecimal() and int(name) < len(names):
            name = names[int(name)]
    name = name.replace("_", " ").strip()
    if not name or len(name) > MAX_LENGTH or not math.isfinite(score):
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
    rotation = make_rotation(quaternion / norm) if norm > 1e-6 else np.eye(3)
    sides = np.array([size.x, size.y, size.z], dtype=float)
    return np.abs(to_map[:3, :3] @ rotation) @ np.abs(sides)

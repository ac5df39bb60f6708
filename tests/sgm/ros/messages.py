"""Messages of ROS 2 as plain objects, as rclpy or rosbags would hand them out."""

import io
import struct
from types import SimpleNamespace as Message

import numpy as np
from PIL import Image


def make_header(time, frame="camera"):
    return Message(
        stamp=Message(sec=int(time), nanosec=round((time - int(time)) * 1e9)), frame_id=frame
    )


def make_quaternion(rotation):
    """Return x, y, z, w of a rotation (3, 3), by its largest part."""
    m = rotation
    parts = np.array([m[0, 0] - m[1, 1] - m[2, 2], m[1, 1] - m[0, 0] - m[2, 2],
                      m[2, 2] - m[0, 0] - m[1, 1], np.trace(m)])  # fmt: skip
    k = int(parts.argmax())
    big = np.sqrt(1 + parts[k]) / 2
    if k == 3:
        x, y, z = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
        return np.array([x, y, z, 4 * big * big]) / (4 * big)
    i, j = (k + 1) % 3, (k + 2) % 3
    q = np.zeros(4)
    q[k], q[i], q[j] = 4 * big * big, m[i, k] + m[k, i], m[j, k] + m[k, j]
    q[3] = m[j, i] - m[i, j]
    return q / (4 * big)


def make_transform(time, parent, child, position, quaternion=(0, 0, 0, 1)):
    at, turn = dict(zip("xyz", position, strict=True)), dict(zip("xyzw", quaternion, strict=True))
    return Message(
        header=make_header(time, parent),
        child_frame_id=child,
        transform=Message(translation=Message(**at), rotation=Message(**turn)),
    )


def make_camera_info(intrinsics):
    k = [intrinsics.fx, 0, intrinsics.cx, 0, intrinsics.fy, intrinsics.cy, 0, 0, 1]
    return Message(
        header=make_header(0), height=intrinsics.height, width=intrinsics.width, k=np.array(k)
    )


def make_depth(time, depth, encoding="16UC1", is_bigendian=0, padding=0):
    kind = {"16UC1": "u2", "32FC1": "f4"}[encoding]
    scale = 1000 if encoding == "16UC1" else 1
    values = np.nan_to_num(depth * scale, nan=0, posinf=0) if scale > 1 else depth
    rows = values.astype((">" if is_bigendian else "<") + kind)
    data = rows.view(np.uint8).reshape(len(depth), -1)
    data = np.pad(data, ((0, 0), (0, padding)))
    return Message(
        header=make_header(time),
        height=len(depth),
        width=depth.shape[1],
        encoding=encoding,
        is_bigendian=is_bigendian,
        step=data.shape[1],
        data=data.ravel(),
    )


def make_compressed_depth(time, depth, kind="16UC1", scale=(10.0, -0.5)):
    """16UC1: millimetres as PNG after 12 bytes; 32FC1: inverse depth, a / depth + b."""
    if kind == "16UC1":
        values = np.nan_to_num(depth * 1000, nan=0, posinf=0)
    else:
        values = np.maximum(scale[0] / depth + scale[1], 0)
    file = io.BytesIO()
    Image.fromarray(np.rint(values).astype(np.uint16)).save(file, "PNG")
    data = struct.pack("<iff", 0, *scale) + file.getvalue()
    return Message(
        header=make_header(time),
        format=f"{kind}; compressedDepth png",
        data=np.frombuffer(data, dtype=np.uint8),
    )


def make_yolo(time, rows, frame="camera", boxes_3d=(), frame_3d="map"):
    """Rows of name, score and left, top, right, bottom; boxes in space are center and sides."""
    found = []
    for number, (name, score, (left, top, right, bottom)) in enumerate(rows):
        center = Message(position=Message(x=(left + right) / 2, y=(top + bottom) / 2), theta=0.0)
        bbox = Message(center=center, size=Message(x=right - left, y=bottom - top))
        at, sides = boxes_3d[number] if boxes_3d else ((0.0,) * 3, (0.0,) * 3)
        pose = Message(
            position=Message(**dict(zip("xyz", at, strict=True))),
            orientation=Message(x=0.0, y=0.0, z=0.0, w=1.0),
        )
        bbox3d = Message(
            center=pose, size=Message(**dict(zip("xyz", sides, strict=True))), frame_id=frame_3d
        )
        found.append(
            Message(class_id=7, class_name=name, score=score, id="", bbox=bbox, bbox3d=bbox3d)
        )
    return Message(header=make_header(time, frame), detections=found)


def _make_results(name, score):
    return [Message(hypothesis=Message(class_id=name, score=score))]


def make_detections(time, rows, frame="camera"):
    """Rows of name, score and left, top, right, bottom."""
    found = []
    for name, score, (left, top, right, bottom) in rows:
        center = Message(position=Message(x=(left + right) / 2, y=(top + bottom) / 2), theta=0.0)
        bbox = Message(center=center, size_x=right - left, size_y=bottom - top)
        found.append(Message(results=_make_results(name, score), bbox=bbox, id=""))
    return Message(header=make_header(time, frame), detections=found)


def make_detections_3d(time, rows, frame="camera", size=(0.1, 0.1, 0.1)):
    """Rows of name, score and x, y, z."""
    found = []
    for name, score, center in rows:
        pose = Message(
            position=Message(**dict(zip("xyz", center, strict=True))),
            orientation=Message(x=0.0, y=0.0, z=0.0, w=1.0),
        )
        bbox = Message(center=pose, size=Message(**dict(zip("xyz", size, strict=True))))
        found.append(Message(results=_make_results(name, score), bbox=bbox, id=""))
    return Message(header=make_header(time, frame), detections=found)

"""Streams of messages to frames: what belongs to one picture is put together."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import time as get_wall_time
from typing import Any

import numpy as np

from sgm.camera.pinhole import Intrinsics, Pose
from sgm.eyes.look_builder import LookBuilder
from sgm.messages import shorten
from sgm.ros.message_readings import (
    ClassNames,
    list_frames,
    read_camera_info,
    read_depth_image,
    read_detections,
    read_time,
    read_uncertainty,
)
from sgm.ros.transforms import TransformTree

_MOST_WAITING = 200  # pictures whose depth or transform has not come yet
_MOST_DEPTHS = 30  # depth images that are kept
_SET_BACK = 10.0  # seconds by which detections may be out of order, before the clock was set back


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """Detections of a picture that wait for the rest of it."""

    time: float
    frame: str
    message: Any


class CameraFeed:
    """Puts transforms, camera, depth and detections together and shows them to a `LookBuilder`.

    Every message of detections is a frame, also one without any: a detector must publish what it
    did not see, too. A frame waits until its depth image and a transform of its time or later have
    come, `patience` seconds of the messages' own time at most; then it is shown without.

    Messages may be of `rclpy` or of `rosbags`: only their fields are read. What cannot be read is
    counted in `counts`, and never raised.

    Attributes:
        transforms: of the robot.
        counts: messages by what became of them.
    """

    def __init__(
        self,
        builder: LookBuilder,
        *,
        map_frame: str = "map",
        camera_frame: str | None = None,
        names: ClassNames = None,
        pose_sd: tuple[float, float] = (0.02, 0.01),
        uses_depth: bool = True,
        slack: float = 0.05,
        patience: float = 0.5,
        now: Callable[[], float] = get_wall_time,
        on_stamp: Callable[[float], None] = lambda stamp: None,
    ) -> None:
        """Start without messages.

        Args:
            builder: makes the looks.
            map_frame: name of the frame of the map, in which the furniture is given.
            camera_frame: name of the optical frame of the camera; None for that of the CameraInfo,
                else of the detections.
            names: what class ids of the detector mean; None if they are names.
            pose_sd: standard deviations of the robot's position, metres, and of its yaw, radians,
                until a message says them.
            uses_depth: whether frames wait for depth images.
            slack: seconds between a depth image and the detections that it belongs to, at most.
            patience: seconds that a frame waits.
            now: seconds from any start, by which time passes between messages.
            on_stamp: is given the stamp of every message of detections, before its frame is shown.
        """
        self.transforms = TransformTree()
        self.counts: Counter[str] = Counter()
        self._builder, self._names = builder, names
        self._map_frame, self._camera_frame = map_frame, camera_frame
        self._sd = pose_sd
        self._uses_depth, self._slack, self._patience = uses_depth, slack, patience
        self._intrinsics: Intrinsics | None = None
        self._info_frame = ""
        self._depths: deque[tuple[float, np.ndarray]] = deque(maxlen=_MOST_DEPTHS)
        self._waiting: deque[_Waiting] = deque()
        self._clock, self._on_stamp = now, on_stamp
        self._now = -np.inf  # the latest stamp
        self._detected, self._came = -np.inf, 0.0  # that of the latest detections, and when it came
        # The optical frame of a picture without a transform, and whether one had any.
        self._lost, self._was_located = "", False

    def find_gap(self) -> str:
        """Say what is missing of all pictures that came: camera, place or depth; "" for nothing."""
        return self._find_camera_gap() or self._find_transform_gap() or self._find_depth_gap()

    def _find_camera_gap(self) -> str:
        if self._intrinsics is not None or not self.counts["frames before any camera info"]:
            return ""
        unread = self.counts["camera infos that cannot be read"]
        return (
            "detections must come after a CameraInfo, got "
            f"{f'{unread} that cannot be read' if unread else 'none'}. Publish it, or name its "
            "topic."
        )

    def _find_depth_gap(self) -> str:
        without = self.counts["frames without depth"]
        if not without or without < self.counts["frames"]:
            return ""
        if self.counts["depth images of another size than the camera"]:
            got = "some of another size"
        elif self.counts["depth images"]:
            got = f"none within {self._slack:g} s of the detections"
        else:
            unread = self.counts["depth images that cannot be read"]
            got = f"{unread} that cannot be read" if unread else "none"
        return (
            f"detections must have depth images of the camera's size and their time, got {got}. "
            "Name the topic of registered depth, or set uses_depth to false."
        )

    def _find_transform_gap(self) -> str:
        if self._was_located or not self._lost:
            return ""
        known = ", ".join(self.transforms.list_frames())
        return (
            f"transforms must connect the camera's frame {shorten(self._lost)} with "
            f"{shorten(self._map_frame)}, got {shorten(known) if known else 'none'}. Name the "
            "frame of the map, or that of the camera."
        )

    def take_transforms(self, message: Any, *, is_still: bool = False) -> None:
        """Take a `tf2_msgs/TFMessage`; `is_still` for those of /tf_static."""
        for stamped in message.transforms:
            position, turn = stamped.transform.translation, stamped.transform.rotation
            with self._count("transforms"):
                time = read_time(stamped.header)
                self.transforms.add(
                    str(stamped.header.frame_id),
                    str(stamped.child_frame_id),
                    time,
                    (position.x, position.y, position.z),
                    (turn.x, turn.y, turn.z, turn.w),
                    is_still=is_still,
                )
                if not is_still:
                    self._now = max(self._now, time)
        self._show_ready()

    def take_camera(self, message: Any) -> None:
        """Take a `sensor_msgs/CameraInfo`."""
        with self._count("camera infos"):
            self._intrinsics = read_camera_info(message)
            self._info_frame = str(message.header.frame_id)

    def take_depth(self, message: Any) -> None:
        """Take a depth image, registered to the camera of the detections.

        A `sensor_msgs/Image`, or a `sensor_msgs/CompressedImage` (`read_depth_image`).
        """
        with self._count("depth images"):
            time = read_time(message.header)
            self._depths.append((time, read_depth_image(message)))
            self._now = max(self._now, time)
        self._show_ready()

    def take_detections(self, message: Any) -> None:
        """Take a message of detections, of any kind that `read_detections` reads."""
        with self._count("messages of detections", "detections"):
            time, frame = read_time(message.header), str(message.header.frame_id)
            if time < self._detected - _SET_BACK:
                self._set_back()
            self._detected, self._came = time, self._clock()
            self._on_stamp(time)
            self._now = max(self._now, time)
            self._waiting.append(_Waiting(time, frame, message))
        self._show_ready()

    def take_pose(self, message: Any) -> None:
        """Take a `geometry_msgs/PoseWithCovarianceStamped` for how sure the robot's pose is."""
        with self._count("poses"):
            self._sd = read_uncertainty(message.pose.covariance)

    def finish(self) -> None:
        """Show all that waits, as at the end of a recording."""
        while self._waiting:
            self._show(self._waiting.popleft())

    @property
    def present(self) -> float | None:
        """The present by the clock of the messages, in seconds; None before any detections.

        That is the stamp of the latest ones, and what has passed since they came.
        """
        if not np.isfinite(self._detected):
            return None
        return self._detected + max(self._clock() - self._came, 0.0)

    def _set_back(self) -> None:
        """Begin anew with earlier messages, as when a clock was put right."""
        self.counts["times that the clock was set back"] += 1
        self.finish()
        self._builder.finish()
        self._depths.clear()
        self._now = -np.inf

    def _show_ready(self) -> None:
        while self._waiting and (
            self._is_ready(self._waiting[0])
            or self._now > self._waiting[0].time + self._patience
            or len(self._waiting) > _MOST_WAITING
        ):
            self._show(self._waiting.popleft())

    def _is_ready(self, waiting: _Waiting) -> bool:
        """Tell whether a depth image and later transforms are there."""
        if self._uses_depth and self._find_depth(waiting.time) is None:
            return False
        found = self.transforms.find(self._map_frame, self._find_frame(waiting), waiting.time)
        return found is not None and found[1] >= waiting.time

    def _find_frame(self, waiting: _Waiting) -> str:
        """Return the name of the optical frame of the camera."""
        return self._camera_frame or self._info_frame or waiting.frame

    def _find_to_map(self, frame: str, time: float) -> np.ndarray | None:
        """Return the matrix (4, 4) from a frame to the map; None if they are not connected."""
        found = self.transforms.find(self._map_frame, frame, time)
        return None if found is None else found[0]

    def _find_depth(self, time: float) -> np.ndarray | None:
        nearest = min(self._depths, key=lambda stamped: abs(stamped[0] - time), default=None)
        return None if nearest is None or abs(nearest[0] - time) > self._slack else nearest[1]

    def _show(self, waiting: _Waiting) -> None:
        """Show a frame to the builder with what there is of it."""
        if self._intrinsics is None:
            self.counts["frames before any camera info"] += 1
            return
        time = waiting.time
        camera = self.transforms.find(self._map_frame, self._find_frame(waiting), time)
        pose, pose_time = None, None
        with self._count("frames"):
            if camera is None:
                self._lost = self._find_frame(waiting)
            else:
                self._was_located = True
                pose, pose_time = Pose.from_matrix(camera[0], *self._sd), camera[1]
            found = {name: self._find_to_map(name, time) for name in list_frames(waiting.message)}
            if any(matrix is None for matrix in found.values()):
                pose = None  # where these are is unknown
            detections = read_detections(waiting.message, self._names, found.get, self._count_drop)
            depth = self._find_depth(time) if self._uses_depth else None
            size = (self._intrinsics.height, self._intrinsics.width)
            if depth is not None and depth.shape != size:
                self.counts["depth images of another size than the camera"] += 1
                depth = None
            if self._uses_depth and depth is None:
                self.counts["frames without depth"] += 1
            self._builder.frame(time, pose, self._intrinsics, detections, depth, pose_time)

    def _count_drop(self, why: str) -> None:
        self.counts[why] += 1

    @contextmanager
    def _count(self, name: str, unread: str = "") -> Iterator[None]:
        """Count a message that is read, or as one that cannot be."""
        try:
            yield
            self.counts[name] += 1
        except (ValueError, TypeError, AttributeError, OverflowError):
            self.counts[f"{unread or name} that cannot be read"] += 1

"""Which frames and detections are good enough to be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.checks import check_at_least, check_shares
from sgm.eyes.camera import Pose
from sgm.messages import shorten

_JUMP = 4.0  # standard deviations, which the length of a vector of three exceeds once in 1,000


@dataclass(frozen=True, slots=True)
class Gate:
    """Bounds beyond which a frame or a detection is left out.

    Attributes:
        most_position_sd: of the pose, metres.
        most_angle_sd: of the pose, radians.
        most_speed: of the camera, m/s: images are blurred, and depth is of another moment.
        most_turn: of the camera, rad/s.
        most_age: seconds between the image and the pose.
        nearest, farthest: distances at which the detector sees things, metres. Beyond them nothing
            counts as looked at.
        least_score: of a detection.
    """

    most_position_sd: float = 0.15
    most_angle_sd: float = 0.1
    most_speed: float = 0.6
    most_turn: float = 1.0
    most_age: float = 0.12
    nearest: float = 0.2
    farthest: float = 4.0
    least_score: float = 0.1

    def __post_init__(self) -> None:
        """Raise ValueError for what is negative, or a farthest distance within the nearest."""
        check_at_least(
            0, most_position_sd=self.most_position_sd, most_angle_sd=self.most_angle_sd,
            most_speed=self.most_speed, most_turn=self.most_turn, most_age=self.most_age,
            nearest=self.nearest,
        )  # fmt: skip
        check_shares(least_score=self.least_score)
        if not self.farthest > self.nearest:
            raise ValueError(
                f"farthest must be beyond nearest, got {shorten(self.farthest)} and "
                f"{shorten(self.nearest)}. Give metres."
            )

    def find_fault(
        self, time: float, pose: Pose | None, age: float, before: tuple[float, Pose] | None
    ) -> str:
        """Say why a frame at a time is left out, "" if it is good; `before` is the last such.

        The age is in seconds between image and pose, which is None if no transform was found.
        """
        if pose is None:
            return "no transform"
        if not abs(age) <= self.most_age:  # nan is no age
            return "transform too old"
        if pose.position_sd > self.most_position_sd or pose.angle_sd > self.most_angle_sd:
            return "pose uncertain"
        if before is not None and time > before[0]:
            seconds = time - before[0]
            moved = float(np.linalg.norm(pose.position - before[1].position))
            # Of the trace of R1' R2.
            cosine = float((np.sum(pose.rotation * before[1].rotation) - 1) / 2)
            turned = math.acos(min(max(cosine, -1.0), 1.0))
            # A pose that is uncertain jumps about where the camera stands still.
            moved -= _JUMP * math.hypot(pose.position_sd, before[1].position_sd)
            turned -= _JUMP * math.hypot(pose.angle_sd, before[1].angle_sd)
            if moved > self.most_speed * seconds or turned > self.most_turn * seconds:
                return "camera too fast"
        return ""

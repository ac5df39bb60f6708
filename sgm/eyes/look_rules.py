"""Which frames and detections are good enough, and by which rules frames become looks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.camera.pinhole import Pose
from sgm.checks import check_at_least, check_shares
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
            0,
            most_position_sd=self.most_position_sd,
            most_angle_sd=self.most_angle_sd,
            most_speed=self.most_speed,
            most_turn=self.most_turn,
            most_age=self.most_age,
            nearest=self.nearest,
            farthest=self.farthest,
        )
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


@dataclass(frozen=True, slots=True)
class LookRules:
    """What `LookBuilder` takes for in view, for seen and for one visit.

    Attributes:
        margin: metres that a point may lie behind what was measured and be in view.
        through_margin: metres that a ray must go on behind a thing to have gone through it. What
            bears a thing lies but 4 to 13 cm behind it.
        dilation: metres by which volumes are larger for detections, beside the uncertainty of the
            pose.
        num_points: points of each volume that are projected.
        pause: seconds out of view after which a visit is over.
        longest: seconds after which a visit is a look, and a new one begins.
        least_coverage: share in view below which a visit that showed nothing is no look.
        least_confidence: below it, a thing was not seen in the visit.
        most_blind: bound of the coverage where a frame has no depth image: what is in the way is
            not known.
    """

    margin: float = 0.0
    through_margin: float = 0.03
    dilation: float = 0.05
    num_points: int = 1000
    pause: float = 2.0
    longest: float = 30.0
    least_coverage: float = 0.05
    least_confidence: float = 0.5
    most_blind: float = 0.7

    def __post_init__(self) -> None:
        """Raise ValueError for a number that is out of range."""
        check_at_least(
            0,
            margin=self.margin,
            through_margin=self.through_margin,
            dilation=self.dilation,
            pause=self.pause,
            longest=self.longest,
        )
        check_at_least(1, num_points=self.num_points)
        check_shares(
            least_coverage=self.least_coverage,
            least_confidence=self.least_confidence,
            most_blind=self.most_blind,
        )

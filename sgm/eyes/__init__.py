"""From poses, depth and detections to looks: what a robot's camera tells its memory."""

from sgm.eyes.camera import Intrinsics, Pose
from sgm.eyes.detection import Detection
from sgm.layout.box import ABOVE_TOP, BELOW_TOP, INTERIORS, Box, sample_volume

__all__ = [
    "ABOVE_TOP",
    "BELOW_TOP",
    "INTERIORS",
    "Box",
    "Detection",
    "Intrinsics",
    "Pose",
    "sample_volume",
]

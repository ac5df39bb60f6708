"""From poses, depth and detections to looks: what a robot's camera tells its memory."""

from sgm.camera.detection import Detection
from sgm.camera.pinhole import Intrinsics, Pose
from sgm.eyes.built_look import BuiltLook
from sgm.eyes.look_builder import LookBuilder
from sgm.eyes.look_rules import Gate, LookRules
from sgm.eyes.placing import Unassigned
from sgm.layout.box import ABOVE_TOP, BELOW_TOP, INTERIORS, Box, sample_volume
from sgm.layout.viewpoint import Viewpoint
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.mapping.map_rules import MapRules

__all__ = [
    "ABOVE_TOP",
    "BELOW_TOP",
    "INTERIORS",
    "Box",
    "BuiltLook",
    "Detection",
    "FurnitureLabels",
    "FurnitureMapper",
    "Gate",
    "Intrinsics",
    "LookBuilder",
    "LookRules",
    "MapRules",
    "Pose",
    "Unassigned",
    "Viewpoint",
    "sample_volume",
]

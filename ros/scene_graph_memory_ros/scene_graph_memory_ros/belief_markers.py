"""Where a thing may be, as boxes that RViz draws, and where to look next, as a pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import PoseStamped
from visualization_msgs.msg import Marker, MarkerArray

from sgm.ros.live_memory import BeliefMarker, NextPose


def make_pose(look: NextPose, frame: str, stamp: Any) -> PoseStamped:
    """Return the pose to stand at, in the frame of the map, for a planner."""
    pose = PoseStamped()
    pose.header.frame_id, pose.header.stamp = frame, stamp
    pose.pose.position.x, pose.pose.position.y = look.position
    pose.pose.orientation.z = math.sin(look.yaw / 2)
    pose.pose.orientation.w = math.cos(look.yaw / 2)
    return pose


def make_markers(rows: Sequence[BeliefMarker], frame: str) -> MarkerArray:
    """Return boxes that are the redder the likelier, with texts above them, instead of all before.

    `frame` is the name of the frame of the map.
    """
    markers = [Marker(action=Marker.DELETEALL)]
    for row in rows:
        markers += [_mark(row, frame, Marker.CUBE), _mark(row, frame, Marker.TEXT_VIEW_FACING)]
    return MarkerArray(markers=markers)


def _mark(row: BeliefMarker, frame: str, kind: int) -> Marker:
    is_text = kind == Marker.TEXT_VIEW_FACING
    mark = Marker(type=kind, ns="text" if is_text else "belief", id=row.furniture)
    mark.header.frame_id = frame
    at, size = mark.pose.position, mark.scale
    at.x, at.y, at.z = row.box.center
    mark.pose.orientation.z = math.sin(row.box.yaw / 2)
    mark.pose.orientation.w = math.cos(row.box.yaw / 2)
    size.x, size.y, size.z = row.box.size
    mark.color.r, mark.color.g = 1.0, 1.0 - row.probability
    mark.color.a = 0.2 + 0.6 * row.probability
    if is_text:
        at.z, size.z = row.box.top + 0.2, 0.15
        mark.text, mark.color.a = row.text, 1.0
    return mark

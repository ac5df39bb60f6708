"""Messages of ROS 2, decoded by any library, to frames of a camera; needs no ROS."""

from sgm.finder.home_map import HomeMap
from sgm.ros.camera_feed import CameraFeed
from sgm.ros.graph_furniture import GraphFurniture
from sgm.ros.live_memory import LiveMemory
from sgm.ros.transforms import TransformTree

__all__ = ["CameraFeed", "GraphFurniture", "HomeMap", "LiveMemory", "TransformTree"]

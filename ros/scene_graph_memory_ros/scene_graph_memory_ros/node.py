"""A node that remembers what a camera shows and says where things are; `sgm` does the work."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path
from typing import Any

import rclpy
import yaml
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from scene_graph_memory_msgs.srv import Rank, Search
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import String, UInt32
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from scene_graph_memory_ros.belief_markers import make_markers, make_pose
from sgm import Adaptive, Finder, ObjectFinder, SceneGraphMemory
from sgm.eyes import FurnitureLabels, FurnitureMapper
from sgm.layout.areas import Areas
from sgm.ros import GraphFurniture, HomeMap, LiveMemory

# Parameters and their defaults.
PARAMETERS: dict[str, Any] = {
    "map_file": "",  # rooms and furniture with boxes (docs/bags.md); found in the frames if empty
    "areas_file": "",  # rooms as polygons, for furniture that is found
    "furniture_names_file": "",  # further names of furniture: aliases by label
    "memory_file": "",  # is gone on with if it exists, and saved every `save_seconds`
    "log_file": "",  # of every look
    "network": "",  # "any_home", or a folder; heuristics if empty
    "map_frame": "map",
    "base_frame": "base_link",
    "ignore": [""],  # names of what is no thing, such as person and wall
    "camera_frame": "",  # that of the detections if empty
    "detections_type": "Detection2DArray",  # or another one of `DETECTIONS`
    "uses_depth": True,
    "compressed_depth": False,  # whether depth is a CompressedImage
    "scene_graph": False,  # whether Hydra's DsgUpdate gives furniture, on the topic scene_graph
    "step_seconds": 600.0,
    "save_seconds": 60.0,
}

# Messages of detections, and the packages that define them.
DETECTIONS = {
    "Detection2DArray": "vision_msgs.msg",
    "Detection3DArray": "vision_msgs.msg",
    "DetectionArray": "yolo_msgs.msg",
}


class MemoryNode(Node):
    """Subscribes to transforms, camera, depth and detections; answers `rank` and `search`."""

    def __init__(self) -> None:
        """Load or begin the memory, and connect all topics."""
        super().__init__("scene_graph_memory")
        read = {
            name: self.declare_parameter(name, usual).value for name, usual in PARAMETERS.items()
        }
        self._frames = read["map_frame"], read["base_frame"]
        self._file = Path(read["memory_file"]) if read["memory_file"] else None
        finder = ObjectFinder.load(read["network"]) if read["network"] else Finder(Adaptive())
        memory = self._make_memory(read["map_file"], read["log_file"] or None)
        files = (Areas, read["areas_file"]), (FurnitureLabels, read["furniture_names_file"])
        areas, labels = (kind.from_values(_read(at), at) if at else None for kind, at in files)
        graph = GraphFurniture(memory, areas=areas, labels=labels) if read["scene_graph"] else None
        mapper = FurnitureMapper(memory, areas=areas, labels=labels)
        self._live = LiveMemory(
            memory,
            finder,
            discover=None if read["map_file"] else mapper,
            graph=graph,
            labels=labels,
            step_seconds=read["step_seconds"],
            ignore=[name for name in read["ignore"] if name],  # ROS has no list without a value
            on_look=lambda look: self.get_logger().info(
                f"looked at {self._live.memory.describe(look.furniture)}: {len(look.seen)} things"
            ),
            map_frame=read["map_frame"],
            camera_frame=read["camera_frame"] or None,
            uses_depth=read["uses_depth"],
        )
        feed, builder = self._live.feed, self._live.builder
        still = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        depth = CompressedImage if read["compressed_depth"] else Image
        for kind, topic, take, quality in (
            (TFMessage, "/tf", feed.take_transforms, 100),
            (TFMessage, "/tf_static", lambda m: feed.take_transforms(m, is_still=True), still),
            (CameraInfo, "camera_info", feed.take_camera, qos_profile_sensor_data),
            (depth, "depth", feed.take_depth, qos_profile_sensor_data),
            (PoseWithCovarianceStamped, "pose", feed.take_pose, 10),
            (_find_type(read["detections_type"]), "detections", feed.take_detections, 10),
            (UInt32, "~/opened", lambda m: builder.set_open(m.data), 10),
            (UInt32, "~/shut", lambda m: builder.set_open(m.data, is_open=False), 10),
            (String, "~/show", lambda m: self._show(m.data), 10),
        ):
            self.create_subscription(kind, topic, self._guard(take), quality)
        if graph is not None:
            update = import_module("hydra_msgs.msg").DsgUpdate
            self.create_subscription(update, "scene_graph", self._guard(self._live.take_graph), 1)
        self._next = self.create_publisher(PoseStamped, "~/next_look", 10)
        self._belief = self.create_publisher(MarkerArray, "~/belief", 10)
        self.create_service(Rank, "~/rank", self._rank)
        self.create_service(Search, "~/search", self._search)
        if self._file is not None:
            self.create_timer(read["save_seconds"], self.save)

    def save(self) -> None:
        """Write the memory to its file."""
        if self._file is not None:
            self._live.memory.save(self._file)

    def finish(self) -> None:
        """End the visit that goes on, and save."""
        self._live.finish()
        self.save()

    def _make_memory(self, map_file: str, log: str | None) -> SceneGraphMemory:
        if self._file is not None and self._file.exists():
            return SceneGraphMemory.load(self._file, log=log)
        memory = SceneGraphMemory(log=log)
        if map_file:
            HomeMap.from_values(_read(map_file), map_file).add_to(memory)
        return memory

    def _guard(self, take: Any) -> Any:
        """Return a callback that reports bad input and lives on."""

        def call(message: Any) -> None:
            try:
                take(message)
            except (ValueError, KeyError, ModuleNotFoundError) as error:
                self.get_logger().warning(str(error))

        return call

    def _rank(self, request: Any, response: Any) -> Any:
        try:
            ranking = self._live.rank(request.description, request.k or None)
        except ValueError as error:
            response.text = str(error)
            return response
        response.furniture = [place.furniture for place in ranking]
        response.names = [place.name for place in ranking]
        response.probabilities = [place.probability for place in ranking]
        response.positions = [x for place in ranking for x in place.position or [math.nan] * 3]
        response.elsewhere, response.text = ranking.elsewhere, str(ranking)
        self._show(request.description)
        return response

    def _search(self, request: Any, response: Any) -> Any:
        try:
            look = self._live.find_next(request.description, self._find_position())
        except ValueError as error:
            response.is_over, response.outcome, response.furniture = True, str(error), -1
            return response
        response.is_over, response.outcome = look.furniture < 0, look.outcome
        response.furniture, response.name = look.furniture, look.name
        response.probability = look.probability
        if not response.is_over:
            response.pose = make_pose(look, self._frames[0], self.get_clock().now().to_msg())
            self._next.publish(response.pose)
        self._show(request.description)
        return response

    def _find_position(self) -> tuple[float, float] | None:
        """Return x, y of the robot in the map; None if no transform says."""
        now = self.get_clock().now().nanoseconds * 1e-9
        found = self._live.feed.transforms.find(*self._frames, now)
        return None if found is None else (float(found[0][0, 3]), float(found[0][1, 3]))

    def _show(self, description: str) -> None:
        """Publish where a thing may be."""
        self._belief.publish(make_markers(self._live.list_markers(description), self._frames[0]))


def _read(path: str) -> Any:
    return yaml.safe_load(Path(path).read_text("utf-8"))


def _find_type(name: str) -> Any:
    """Return the type of detections of a name; its package need not be there for the others."""
    if name not in DETECTIONS:
        raise ValueError(
            f"detections_type must be one of {', '.join(DETECTIONS)}, got {name!r}. Choose one."
        )
    return getattr(import_module(DETECTIONS[name]), name)


def main(args: list[str] | None = None) -> None:
    """Run the node until it is stopped."""
    rclpy.init(args=args)
    node = MemoryNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.finish()
        node.destroy_node()
        rclpy.try_shutdown()

"""A node that remembers what a camera shows and says where things are; `sgm` does the work."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from scene_graph_memory_msgs.srv import Rank, Search
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import String, UInt32
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from scene_graph_memory_ros.belief_markers import make_markers, make_pose
from scene_graph_memory_ros.gap_watch import GapWatch
from scene_graph_memory_ros.parameters import (
    find_message,
    find_path,
    find_type,
    read_parameters,
    read_yaml,
)
from sgm import Adaptive, Finder, ObjectFinder, SceneGraphMemory
from sgm.eyes import FurnitureLabels, FurnitureMapper
from sgm.layout.areas import Areas
from sgm.memory.steady_clock import read_even_seconds
from sgm.ros import GraphFurniture, HomeMap, LiveMemory


class MemoryNode(Node):
    """Subscribes to transforms, camera, depth and detections; answers `rank` and `search`."""

    def __init__(self) -> None:
        """Load or begin the memory, and connect all topics."""
        super().__init__("scene_graph_memory")
        read = read_parameters(self)
        self._frames = read["map_frame"], read["base_frame"]
        self._file = find_path(read["memory_file"])
        finder = ObjectFinder.load(read["network"]) if read["network"] else Finder(Adaptive())
        memory = self._make_memory(read["map_file"])
        files = (Areas, read["areas_file"]), (FurnitureLabels, read["furniture_names_file"])
        areas, labels = (kind.from_values(read_yaml(at), at) if at else None for kind, at in files)
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
            accept_jump=read["accept_jump"],
            on_warning=self.get_logger().warning,
            now=lambda: self.get_clock().now().nanoseconds * 1e-9,
            monotonic=None if self.get_parameter("use_sim_time").value else read_even_seconds,
            map_frame=read["map_frame"],
            camera_frame=read["camera_frame"] or None,
            uses_depth=read["uses_depth"],
        )
        feed, builder = self._live.feed, self._live.builder
        still = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        # Detectors publish as sensors do, or reliably: this hears both.
        found = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
        depth = CompressedImage if read["compressed_depth"] else Image
        heard = {}
        for kind, topic, take, quality in (
            (TFMessage, "/tf", feed.take_transforms, 100),
            (TFMessage, "/tf_static", lambda m: feed.take_transforms(m, is_still=True), still),
            (CameraInfo, "camera_info", feed.take_camera, qos_profile_sensor_data),
            (depth, "depth", feed.take_depth, qos_profile_sensor_data),
            (PoseWithCovarianceStamped, "pose", feed.take_pose, found),
            (find_type(read["detections_type"]), "detections", feed.take_detections, found),
            (UInt32, "~/opened", lambda m: builder.set_open(m.data), 10),
            (UInt32, "~/shut", lambda m: builder.set_open(m.data, is_open=False), 10),
            (String, "~/show", lambda m: self._show(m.data), 10),
        ):
            heard[topic] = self.create_subscription(kind, topic, self._guard(take), quality)
        if graph is not None:
            update = find_message("hydra_msgs.msg", "DsgUpdate", "scene_graph: true")
            self.create_subscription(update, "scene_graph", self._guard(self._live.take_graph), 1)
        self._next = self.create_publisher(PoseStamped, "~/next_look", 10)
        self._belief = self.create_publisher(MarkerArray, "~/belief", 10)
        self.create_service(Rank, "~/rank", self._rank)
        self.create_service(Search, "~/search", self._search)
        needed = ["camera_info", *(["depth"] if read["uses_depth"] else []), "detections"]
        GapWatch(self, feed, [heard[topic] for topic in needed])
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

    def _make_memory(self, map_file: str) -> SceneGraphMemory:
        if self._file is not None and self._file.exists():
            return SceneGraphMemory.open(self._file)
        memory = SceneGraphMemory(path=self._file)
        if map_file:
            HomeMap.from_values(read_yaml(map_file), map_file).add_to(memory)
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

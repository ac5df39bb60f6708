"""The node of `ros/` with a stand-in for the few calls of ROS 2 that it makes."""

import ast
import importlib
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from types import ModuleType
from types import SimpleNamespace as Message
from typing import ClassVar

import numpy as np
import pytest
import yaml

from sgm import SceneGraphMemory
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, look_around, put_on, render
from tests.sgm.ros.messages import (
    make_camera_info,
    make_depth,
    make_detections,
    make_quaternion,
    make_transform,
)
from tests.sgm.ros.test_feed import MAP, find_box

ROS = Path(__file__).parents[2] / "ros"
PACKAGE = ROS / "scene_graph_memory_ros"


class Blank:
    """A message whose fields begin to be when they are read or written."""

    def __init__(self, **fields):
        self.__dict__.update(fields)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        made = self.__dict__[name] = Blank()
        return made


def make_kind(package, name):
    """Make a type of message that tells its package, as those of rclpy do."""
    return type(name, (Blank,), {"__module__": f"{package}.msg._module_of_it"})


class Marker(Blank):
    CUBE, TEXT_VIEW_FACING, DELETEALL = 1, 9, 3


class StandIn:
    """What `rclpy.node.Node` offers and the node uses."""

    parameters: ClassVar[dict] = {}
    types: ClassVar[dict] = {  # that are published, by topic
        "/camera_info": ["sensor_msgs/msg/CameraInfo"],
        "/depth": ["sensor_msgs/msg/Image"],
        "/detections": ["vision_msgs/msg/Detection2DArray"],
    }

    def __init__(self, name):
        self.name = name
        self.declared = {"use_sim_time"}
        self.subscribed, self.services, self.published, self.timers = {}, {}, {}, []
        self.publishers = {}  # type and quality by topic
        self.warnings, self.told = [], []
        self._parameter_overrides = self.parameters

    def has_parameter(self, name):
        return name in self.declared

    def declare_parameter(self, name, usual, descriptor):
        assert descriptor.description
        self.declared.add(name)
        value = self.parameters.get(name, usual)
        assert value is None or type(value) is type(usual), name
        return Message(value=value)

    def get_parameter(self, name):
        return Message(value=self.parameters.get(name, False))

    def create_subscription(self, kind, topic, callback, quality):
        self.subscribed[topic] = callback
        return Message(topic_name=f"/{topic}", msg_type=kind)

    def get_publishers_info_by_topic(self, topic):
        return [Message(topic_type=name) for name in self.types.get(topic, ())]

    def create_publisher(self, kind, topic, quality):
        sent = self.published[topic] = []
        self.publishers[topic] = f"{kind.__module__.split('.')[0]}/{kind.__name__}", quality
        return Message(publish=sent.append)

    def create_service(self, kind, name, callback):
        self.services[name] = callback

    def create_timer(self, seconds, callback):
        self.timers.append((seconds, callback))

    def get_logger(self):
        return Message(info=self.told.append, warning=self.warnings.append)

    def get_clock(self):
        stamp = Message(sec=102, nanosec=0)
        return Message(now=lambda: Message(nanoseconds=102_000_000_000, to_msg=lambda: stamp))


MODULES = {
    "rclpy": {},
    "rclpy.exceptions": {"ParameterException": RuntimeError},
    "rclpy.executors": {"ExternalShutdownException": RuntimeError, "SingleThreadedExecutor": Blank},
    "rclpy.signals": {"SignalHandlerOptions": Blank},
    "rclpy.node": {"Node": StandIn},
    "rclpy.qos": {
        "DurabilityPolicy": Message(TRANSIENT_LOCAL=1),
        "QoSProfile": Blank,
        "ReliabilityPolicy": Message(BEST_EFFORT=2),
        "qos_profile_sensor_data": 5,
    },
    "rcl_interfaces.msg": {"ParameterDescriptor": Blank},
    "geometry_msgs.msg": {
        name: make_kind("geometry_msgs", name)
        for name in ("PoseStamped", "PoseWithCovarianceStamped")
    },
    "sensor_msgs.msg": {
        name: make_kind("sensor_msgs", name) for name in ("CameraInfo", "CompressedImage", "Image")
    },
    "std_msgs.msg": {"String": Blank, "UInt32": Blank},
    "tf2_msgs.msg": {"TFMessage": Blank},
    "vision_msgs.msg": {
        name: make_kind("vision_msgs", name) for name in ("Detection2DArray", "Detection3DArray")
    },
    "yolo_msgs.msg": {"DetectionArray": Blank},
    "hydra_msgs.msg": {"DsgUpdate": Blank},
    "visualization_msgs.msg": {
        "Marker": Marker,
        "MarkerArray": make_kind("visualization_msgs", "MarkerArray"),
    },
    "scene_graph_memory_msgs.srv": {"Rank": Blank, "Search": Blank},
}


@pytest.fixture
def load_node(monkeypatch, tmp_path):
    """Load the module of the node with the stand-in, and make a node with some parameters."""
    for name, content in MODULES.items():
        parts = name.split(".")
        for end in range(1, len(parts) + 1):
            path = ".".join(parts[:end])
            if path not in sys.modules or path == name:
                monkeypatch.setitem(sys.modules, path, ModuleType(path))
        vars(sys.modules[name]).update(content)
    monkeypatch.syspath_prepend(str(PACKAGE))
    for name in (
        "",
        ".belief_markers",
        ".gap_watch",
        ".parameters",
        ".node",
    ):  # made anew, with the stand-in
        monkeypatch.delitem(sys.modules, f"scene_graph_memory_ros{name}", raising=False)
    module = importlib.import_module("scene_graph_memory_ros.node")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(MAP))

    def make(**parameters):
        monkeypatch.setattr(
            StandIn, "parameters", {"map_file": str(tmp_path / "map.yaml"), **parameters}
        )
        return module.MemoryNode()

    return make


def _drive(node, things):
    """Publish what a robot sees that looks at the table."""
    hear = node.subscribed
    hear["camera_info"](make_camera_info(CAMERA))
    still = make_transform(0.0, "camera_link", "camera", (0, 0, 0))
    hear["/tf_static"](Message(transforms=[still]))
    for number, pose in enumerate(look_around(TABLE.center)[:10]):
        time = 100 + 0.2 * number
        rows = [(name, 0.9, find_box(body, pose)) for name, body in things]
        depth = render([TABLE, FLOOR, *(body for _, body in things)], pose)
        hear["detections"](make_detections(time, rows))
        hear["depth"](make_depth(time, depth))
        turn = make_quaternion(pose.rotation)
        camera = make_transform(time, "map", "camera_link", pose.position, turn)
        base = make_transform(time, "map", "base_link", (0.5, 0.25, 0))
        hear["/tf"](Message(transforms=[camera, base]))


def test_camera_in_answers_out(load_node, tmp_path):
    node = load_node(memory_file=str(tmp_path / "home.sgm"))
    _drive(node, [("mug", put_on(TABLE, 0.1, 0.3))])
    node.finish()
    answer = node.services["~/rank"](Message(description="the mug", k=0), Blank())
    assert answer.furniture == [0]
    assert answer.names == ["table 1 in kitchen"]
    assert answer.probabilities[0] > 0.8
    assert answer.text.startswith("the mug")
    assert answer.elsewhere == pytest.approx(1 - answer.probabilities[0])
    answer_positions = np.reshape(answer.positions, (-1, 3))
    answer = node.services["~/search"](Message(description="mug"), Blank())
    assert (answer.is_over, answer.furniture, answer.name) == (False, 0, "table 1 in kitchen")
    (pose,) = node.published["~/next_look"]
    assert pose is answer.pose
    assert pose.header.frame_id == "map"
    x, y = pose.pose.position.x, pose.pose.position.y
    yaw = 2 * np.arctan2(pose.pose.orientation.z, pose.pose.orientation.w)
    aim = np.array(put_on(TABLE, 0.1, 0.3).center[:2]) - (x, y)  # the mug, as it was seen
    np.testing.assert_allclose((np.cos(yaw), np.sin(yaw)), aim / np.linalg.norm(aim), atol=0.05)
    np.testing.assert_allclose(answer_positions, [put_on(TABLE, 0.1, 0.3).center], atol=0.03)
    gone, cube, text = node.published["~/belief"][-1].markers
    assert gone.action == Marker.DELETEALL
    assert (cube.type, text.type) == (Marker.CUBE, Marker.TEXT_VIEW_FACING)
    assert (cube.pose.position.x, cube.pose.position.y) == TABLE.center[:2]
    assert (cube.scale.x, cube.scale.y, cube.scale.z) == TABLE.size
    assert text.text.startswith("table 1 in kitchen")
    assert node._find_position() == (0.5, 0.25)
    assert not node.warnings
    (_, report), (seconds, save) = node.timers
    report()
    assert seconds == 60.0
    save()
    assert SceneGraphMemory.load(tmp_path / "home.sgm").last_seen("mug").times_seen == 1
    again = load_node(memory_file=str(tmp_path / "home.sgm"), map_file="")
    assert again.services["~/rank"](Message(description="mug", k=1), Blank()).furniture == [0]


def test_without_a_map_it_draws_one(load_node, tmp_path):
    (tmp_path / "areas.yaml").write_text("den: [[-9, -9], [9, -9], [9, 9], [-9, 9]]")
    (tmp_path / "names.yaml").write_text("table: [Tisch]")
    files = {"areas_file": "areas.yaml", "furniture_names_file": "names.yaml"}
    node = load_node(map_file="", **{key: str(tmp_path / name) for key, name in files.items()})
    _drive(node, [("mug", put_on(TABLE, 0.1, 0.3)), ("Tisch", TABLE)])
    node.finish()
    answer = node.services["~/rank"](Message(description="mug", k=1), Blank())
    assert answer.names == ["table in den"]
    assert not node.warnings


def test_a_scene_graph_of_hydra_gives_furniture(load_node):
    spark_dsg = pytest.importorskip("spark_dsg", reason="spark_dsg is not installed")
    assert "scene_graph" not in load_node().subscribed
    node = load_node(map_file="", scene_graph=True)
    attributes = spark_dsg.ObjectNodeAttributes()
    attributes.name, attributes.position = "table", np.array(TABLE.center)
    attributes.bounding_box = spark_dsg.BoundingBox(TABLE.size, TABLE.center, TABLE.yaw)
    graph = spark_dsg.DynamicSceneGraph()
    graph.add_node(spark_dsg.DsgLayers.OBJECTS, spark_dsg.NodeSymbol("O", 0), attributes)
    hear = node.subscribed["scene_graph"]
    hear(Message(layer_contents=b"", full_update=True))
    assert [text.split(",")[0] for text in node.warnings] == [
        "DsgUpdate must hold a graph of spark_dsg"
    ]
    hear(Message(layer_contents=graph.to_binary(), full_update=True))
    _drive(node, [("mug", put_on(TABLE, 0.1, 0.3))])
    node.finish()
    answer = node.services["~/rank"](Message(description="mug", k=1), Blank())
    assert answer.names == ["table in home"]
    assert len(node.warnings) == 1


def test_bad_questions_and_bad_input_do_not_end_it(load_node, tmp_path):
    node = load_node()
    assert "description must" in node.services["~/rank"](Message(description="", k=1), Blank()).text
    answer = node.services["~/search"](Message(description=""), Blank())
    assert (answer.is_over, answer.furniture) == (True, -1)
    node.subscribed["~/opened"](Message(data=0))
    node.subscribed["~/opened"](Message(data=99))
    assert ["must have a door" in text for text in node.warnings] == [True, False]
    assert len(node.warnings) == 2
    with pytest.raises(ValueError, match="detections_type must be one of Detection2DArray, "):
        load_node(detections_type="PointCloud2")
    assert "detections" in load_node(detections_type="DetectionArray").subscribed
    (tmp_path / "none.yaml").write_text("")
    with pytest.raises(ValueError, match="map must have rooms and furniture"):
        load_node(map_file=str(tmp_path / "none.yaml"))


def test_missing_transforms_are_said_once(load_node):
    node = load_node()
    node.subscribed["camera_info"](make_camera_info(CAMERA))
    node.subscribed["detections"](make_detections(100.0, []))
    node.finish()
    for _ in range(3):
        node.timers[0][1]()
    (warning,) = node.warnings
    assert "transforms must connect the camera's frame 'camera' with 'map'" in warning


def test_topics_that_nobody_publishes_are_said(load_node, monkeypatch):
    node = load_node()
    assert node.told == ["ready, and listens to /camera_info, /depth, /detections"]
    report = node.timers[0][1]
    report()
    assert node.warnings == []
    types = {"/camera_info": ["sensor_msgs/msg/CameraInfo"], "/detections": ["yolo_msgs/msg/Other"]}
    monkeypatch.setattr(StandIn, "types", types)
    for _ in range(2):
        report()
    assert node.warnings == [
        "/depth must have a publisher of sensor_msgs/msg/Image, got none. Start it, or name its "
        "topic. /detections must have a publisher of vision_msgs/msg/Detection2DArray, got "
        "yolo_msgs/msg/Other. Start it, or name its topic."
    ]
    node = load_node(uses_depth=False, detections_type="Detection3DArray")
    node.timers[0][1]()
    (warning,) = node.warnings
    assert warning.startswith("/detections must have a publisher of vision_msgs/msg/Detection3D")


def test_parameters_that_are_none_of_it_are_said(load_node):
    node = load_node(memoryfile="home.sgm", speed_of_wheels=1.0, use_sim_time=False)
    assert node.warnings == [
        "parameters must be of this node, got 'memoryfile', which is ignored. Did you mean "
        "memory_file?",
        "parameters must be of this node, got 'speed_of_wheels', which is ignored. See "
        "config/memory.yaml.",
    ]


def test_values_of_parameters_are_checked(load_node, tmp_path):
    assert load_node(ignore=None).warnings == []  # what rclpy makes of `ignore: []`
    for name in ("save_seconds", "step_seconds"):
        with pytest.raises(ValueError, match=f"{name} must be at least 1, got 0.0"):
            load_node(**{name: 0.0})
    (tmp_path / "bad.yaml").write_text("rooms: [")
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\xfa")
    for name in ("map_file", "areas_file", "furniture_names_file"):
        for file in ("bad.yaml", "bytes.yaml"):
            with pytest.raises(ValueError, match=f"must be YAML, got .* in .*{file}"):
                load_node(**{name: str(tmp_path / file)})


def test_the_files_beside_the_node_fit_it(load_node):
    """The launch file, the file of parameters and that of RViz name what there is."""
    node = load_node()
    parameters = sys.modules["scene_graph_memory_ros.parameters"].PARAMETERS
    file = yaml.safe_load((PACKAGE / "config" / "memory.yaml").read_text("utf-8"))
    written = file["/**"]["ros__parameters"]
    assert written == {name: parameter.usual for name, parameter in parameters.items()}
    launch = ET.parse(PACKAGE / "launch" / "memory.launch.xml").getroot()
    topics = {"depth", "detections", "camera_info", "pose"}
    assert {one.get("from") for one in launch.iter("remap")} == topics <= {*node.subscribed}
    assert {one.get("name") for one in launch.iter("param")} - {None} == {"use_sim_time"}
    for one in launch.iter("node"):  # RViz, too: else it waits for transforms of another time
        assert one.find("param[@name='use_sim_time']") is not None, one.get("name")
    setup = (PACKAGE / "setup.py").read_text("utf-8")
    for path in ("launch/memory.launch.xml", "config/memory.yaml", "rviz/memory.rviz"):
        assert f'"{path}"' in setup
    page = (ROS / "README.md").read_text("utf-8")
    assert all(f"`{name}`" in page for name in parameters)
    assert all(f"`{one.get('name')}:=" in page for one in launch.iter("arg"))


# What the displays of RViz read, by their classes.
READ_BY_RVIZ = {
    "rviz_default_plugins/Map": "nav_msgs/OccupancyGrid",
    "rviz_default_plugins/MarkerArray": "visualization_msgs/MarkerArray",
    "rviz_default_plugins/Pose": "geometry_msgs/PoseStamped",
}


def test_rviz_shows_what_the_node_publishes(load_node):
    """Topics, types, qualities and the frame: if one differs, RViz shows nothing."""
    node = load_node()
    file = yaml.safe_load((PACKAGE / "rviz" / "memory.rviz").read_text("utf-8"))
    manager = file["Visualization Manager"]
    shown = {}
    for display in manager["Displays"]:
        assert display["Enabled"]
        if "Topic" in display:
            topic = display["Topic"]
            quality = topic["Reliability Policy"], topic["Durability Policy"]
            shown[topic["Value"]] = READ_BY_RVIZ[display["Class"]], quality
    # As map servers publish it: once, for all who come later.
    assert shown.pop("/map") == ("nav_msgs/OccupancyGrid", ("Reliable", "Transient Local"))
    (launched,) = (
        one
        for one in ET.parse(PACKAGE / "launch" / "memory.launch.xml").iter("node")
        if one.get("exec") == "memory_node"
    )
    name = launched.get("name")
    assert shown == {
        # A number is the depth of a queue: reliable and volatile, as rclpy has it.
        f"/{name}{topic[1:]}": (kind, ("Reliable", "Volatile"))
        for topic, (kind, quality) in node.publishers.items()
        if quality == 10
    }
    assert len(shown) == len(node.publishers)
    frame = sys.modules["scene_graph_memory_ros.parameters"].PARAMETERS["map_frame"].usual
    assert manager["Global Options"]["Fixed Frame"] == frame
    assert manager["Views"]["Current"]["Target Frame"] == frame
    _drive(node, [("mug", put_on(TABLE, 0.1, 0.3))])
    node.services["~/search"](Message(description="mug"), Blank())
    (pose,), (*_, belief) = node.published["~/next_look"], node.published["~/belief"]
    _, *marks = belief.markers  # the first takes away what was before
    assert {pose.header.frame_id, *(mark.header.frame_id for mark in marks)} == {frame}
    assert marks


@pytest.mark.parametrize(
    ("parameters", "package"),
    [
        ({"detections_type": "DetectionArray"}, "yolo_msgs"),
        ({"detections_type": "Detection3DArray"}, "vision_msgs"),
        ({"scene_graph": True}, "hydra_msgs"),
    ],
)
def test_a_missing_package_of_messages_is_one_line_with_its_remedy(
    load_node, monkeypatch, parameters, package
):
    load_node()
    asked = next(f"{name} {value}" for name, value in parameters.items())
    start = f"package {package} must be in the workspace for {asked.replace(' True', ': true')}"
    monkeypatch.setitem(sys.modules, f"{package}.msg", ModuleType(f"{package}.msg"))  # an old one
    with pytest.raises(ModuleNotFoundError, match=f"{start}, got .* has no attribute"):
        load_node(**parameters)
    monkeypatch.delitem(sys.modules, f"{package}.msg")
    monkeypatch.delitem(sys.modules, package)
    with pytest.raises(ModuleNotFoundError, match=f"{start}, got none. Put it into src, build it"):
        load_node(**parameters)


@pytest.mark.parametrize("package", ["rclpy", "tf2_msgs", "scene_graph_memory_msgs", "sgm"])
def test_what_is_not_set_up_is_one_line(load_node, monkeypatch, capsys, package):
    """As where a setup file was not read, or the environment is not active."""
    load_node()
    for name in ("", ".msg", ".srv", ".exceptions"):
        monkeypatch.setitem(sys.modules, f"{package}{name}", None)  # is not found
    monkeypatch.delitem(sys.modules, "scene_graph_memory_ros.node")
    monkeypatch.setattr("signal.signal", lambda *_: None)
    run = importlib.import_module("scene_graph_memory_ros.run")
    assert run.main() == 1
    assert capsys.readouterr().err == (
        f"error: package {package} must be there, got none. Read the setup files of ROS and of the "
        "workspace, and activate the environment with sgm.\n"
    )


def test_packages_are_whole():
    for folder in ("scene_graph_memory_msgs", "scene_graph_memory_ros"):
        root = ET.parse(ROS / folder / "package.xml").getroot()
        assert root.findtext("name") == folder
        assert root.findtext("license") == "Apache-2.0"
    source = (PACKAGE / "scene_graph_memory_ros" / "node.py").read_text("utf-8")
    assert sum(isinstance(part, ast.stmt) for part in ast.walk(ast.parse(source))) <= 124
    needs = {one.text for one in ET.parse(PACKAGE / "package.xml").getroot().iter("exec_depend")}
    used = {name.split(".")[0] for name in MODULES}
    if_asked_for = {"yolo_msgs", "hydra_msgs"}
    others = {"python3-numpy", "python3-pil", "python3-yaml", "ros2launch", "rviz2"}
    assert used - if_asked_for | others == needs
    services = ROS / "scene_graph_memory_msgs"
    assert '"srv/Rank.srv"' in (services / "CMakeLists.txt").read_text("utf-8")
    for name in ("Rank", "Search"):
        request, response = (services / "srv" / f"{name}.srv").read_text("utf-8").split("---")
        assert "string description" in request
        fields = [line.split()[1] for line in response.strip().splitlines() if line.strip()]
        assert all(f"response.{field}" in source for field in fields), fields
    assert (PACKAGE / "resource" / "scene_graph_memory_ros").is_file()

"""The node of `ros/` under ROS 2, as a process of its own: `make ros-test`."""

import array
import os
import re
import signal
import subprocess
import time
import xml.etree.ElementTree as ET
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

rclpy = pytest.importorskip("rclpy", reason="ROS 2 is not installed: run make ros-test")
if not hasattr(rclpy, "spin_once"):  # a stand-in of test_node.py
    pytest.skip("ROS 2 is not installed: run make ros-test", allow_module_level=True)

from builtin_interfaces.msg import Time  # noqa: E402
from geometry_msgs.msg import PoseStamped, TransformStamped  # noqa: E402
from rcl_interfaces.srv import DescribeParameters, ListParameters  # noqa: E402
from rclpy.qos import (  # noqa: E402
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rosgraph_msgs.msg import Clock as ClockMessage  # noqa: E402
from scene_graph_memory_msgs.srv import Rank, Search  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from vision_msgs.msg import (  # noqa: E402
    Detection2D,
    Detection2DArray,
    Detection3D,
    Detection3DArray,
    ObjectHypothesisWithPose,
)
from visualization_msgs.msg import MarkerArray  # noqa: E402

from sgm import SceneGraphMemory  # noqa: E402
from tests.sgm.eyes.scenes import (  # noqa: E402
    CAMERA,
    FLOOR,
    TABLE,
    look_around,
    put_on,
    render,
)
from tests.sgm.ros.messages import make_quaternion  # noqa: E402
from tests.sgm.ros.test_feed import MAP, find_box  # noqa: E402

ROS = Path(__file__).parents[2] / "ros" / "scene_graph_memory_ros"
NODE = "/scene_graph_memory"
MUG = put_on(TABLE, 0.1, 0.3)
POSES = look_around(TABLE.center)[:8]
START = int(datetime(2026, 11, 16, 20, 0).timestamp())
HOUR = 3600.0
SENSOR = qos_profile_sensor_data
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE = 60.0  # seconds of waiting for what comes in one


def make_time(seconds):
    return Time(sec=int(seconds), nanosec=round((seconds - int(seconds)) * 1e9))


def make_transform(seconds, parent, child, position, turn=(0.0, 0.0, 0.0, 1.0)):
    made = TransformStamped(child_frame_id=child)
    made.header.stamp, made.header.frame_id = make_time(seconds), parent
    at, rotation = made.transform.translation, made.transform.rotation
    at.x, at.y, at.z = map(float, position)
    rotation.x, rotation.y, rotation.z, rotation.w = map(float, turn)
    return made


def make_depth(seconds, depth):
    values = np.nan_to_num(depth * 1000, nan=0, posinf=0).astype("<u2")
    made = Image(height=len(depth), width=depth.shape[1], encoding="16UC1")
    made.header.stamp, made.header.frame_id = make_time(seconds), "camera"
    made.step = 2 * depth.shape[1]
    made.data = array.array("B", values.tobytes())
    return made


def make_result(name):
    result = ObjectHypothesisWithPose()
    result.hypothesis.class_id, result.hypothesis.score = name, 0.9
    return [result]


def make_detections(seconds, things, pose):
    made = Detection2DArray()
    made.header.stamp, made.header.frame_id = make_time(seconds), "camera"
    for name, body in things:
        left, top, right, bottom = map(float, find_box(body, pose))
        found = Detection2D(results=make_result(name))
        found.bbox.center.position.x = (left + right) / 2
        found.bbox.center.position.y = (top + bottom) / 2
        found.bbox.size_x, found.bbox.size_y = right - left, bottom - top
        made.detections.append(found)
    return made


def make_detections_3d(seconds, things):
    made = Detection3DArray()
    made.header.stamp, made.header.frame_id = make_time(seconds), "map"
    for name, body in things:
        found = Detection3D(results=make_result(name))
        at, size = found.bbox.center.position, found.bbox.size
        at.x, at.y, at.z = map(float, body.center)
        size.x, size.y, size.z = map(float, body.size)
        made.detections.append(found)
    return made


class Robot:
    """What publishes as a robot does, by a clock that it sets, and asks."""

    def __init__(self, now, detections_type, quality):
        self.node = node = rclpy.create_node("robot_of_the_test")
        self.now = float(now)
        self.poses_next, self.beliefs = [], []
        kinds = {"Detection2DArray": Detection2DArray, "Detection3DArray": Detection3DArray}
        make = node.create_publisher
        self.to = {
            "clock": make(ClockMessage, "/clock", 10),
            "tf": make(TFMessage, "/tf", 100),
            "tf_static": make(TFMessage, "/tf_static", LATCHED),
            "camera_info": make(CameraInfo, "/eye/camera_info", quality),
            "depth": make(Image, "/eye/depth", quality),
            "detections": make(
                kinds.get(detections_type, Detection2DArray), "/detector/found", quality
            ),
        }
        node.create_timer(0.05, self.publish_clock)  # as simulations do: a single one may be lost
        take = node.create_subscription
        take(PoseStamped, f"{NODE}/next_look", self.poses_next.append, 10)
        take(MarkerArray, f"{NODE}/belief", self.beliefs.append, 10)
        self.clients = {
            kind: node.create_client(kind, f"{NODE}/{name}")
            for kind, name in (
                (Rank, "rank"),
                (Search, "search"),
                (ListParameters, "list_parameters"),
                (DescribeParameters, "describe_parameters"),
            )
        }

    def wait(self, is_done):
        end = time.monotonic() + PATIENCE
        while not is_done():
            assert time.monotonic() < end, "the node did not answer in time"
            rclpy.spin_once(self.node, timeout_sec=0.05)

    def connect(self):
        """Wait until the node hears and answers."""
        self.wait(lambda: self.clients[Rank].service_is_ready())
        self.wait(lambda: all(one.get_subscription_count() for one in self.to.values()))
        still = make_transform(0.0, "camera_link", "camera", (0, 0, 0))
        self.to["tf_static"].publish(TFMessage(transforms=[still]))
        self.spin(1.0)  # the node may hear later than it is counted

    def publish_clock(self):
        """Say the time that all nodes read."""
        self.to["clock"].publish(ClockMessage(clock=make_time(self.now)))

    def tick(self, seconds):
        """Let time pass."""
        self.now += seconds
        self.publish_clock()
        self.spin(0.1)

    def spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.02)

    def ask(self, kind, **request):
        future = self.clients[kind].call_async(kind.Request(**request))
        self.wait(future.done)
        return future.result()

    def rank(self, thing="mug"):
        return self.ask(Rank, description=thing, k=3)

    def show(self, pose, things=(("mug", MUG),), solid=(TABLE, FLOOR), late=0.0, tf=True):
        """Publish all of one frame."""
        info = CameraInfo(height=CAMERA.height, width=CAMERA.width)
        info.header.stamp, info.header.frame_id = make_time(self.now), "camera"
        info.k = [CAMERA.fx, 0.0, CAMERA.cx, 0.0, CAMERA.fy, CAMERA.cy, 0.0, 0.0, 1.0]
        self.to["camera_info"].publish(info)
        now, bodies = self.now, [body for _, body in things]
        if self.to["detections"].msg_type is Detection3DArray:
            found = make_detections_3d(now, things)
        else:
            found = make_detections(now, things, pose)
        self.to["detections"].publish(found)
        self.to["depth"].publish(make_depth(now, render([*solid, *bodies], pose)))
        self.tick(late)
        turn = make_quaternion(pose.rotation)
        camera = make_transform(now, "map", "camera_link", pose.position, turn)
        base = make_transform(now, "map", "base_link", (0.5, 0.25, 0.0))
        if tf:
            self.to["tf"].publish(TFMessage(transforms=[camera, base]))
        self.tick(0.2 - late)

    def look(self, **options):
        """Look at the table from all around, and turn away, so that the visit ends."""
        for pose in POSES:
            self.show(pose, **options)
        away = look_around((-2.0, 0.0, 0.0))[0]
        for _ in range(2):
            self.tick(1.5)
            self.show(away, things=(), solid=(FLOOR,))

    def leave(self):
        self.node.destroy_node()


@pytest.fixture(scope="module")
def ros():
    """What all nodes of the test need."""
    rclpy.init()
    yield
    rclpy.shutdown()


def read_launch(**given):
    """Return the command that the launch file makes of its node, as `ros2 launch` reads it."""
    share = Path(os.environ["AMENT_PREFIX_PATH"].split(":")[0])
    root = ET.parse(share / "share" / "scene_graph_memory_ros" / "launch" / "memory.launch.xml")
    values = {}

    def fill(text):
        text = re.sub(r"\$\(find-pkg-share (\w+)\)", rf"{share}/share/\1", text)
        return re.sub(r"\$\(var (\w+)\)", lambda match: values[match[1]], text)

    for argument in root.iter("arg"):
        assert argument.get("description")
        values[argument.get("name")] = fill(
            given.pop(argument.get("name"), argument.get("default"))
        )
    assert not given
    (node,) = (one for one in root.iter("node") if fill(one.get("if", "true")) == "true")
    command = [str(share / "lib" / node.get("pkg") / node.get("exec")), "--ros-args"]
    command += ["-r", f"__node:={node.get('name')}"]
    for one in node:
        if one.tag == "remap":
            command += ["-r", f"{one.get('from')}:={fill(one.get('to'))}"]
        elif one.get("from"):
            assert Path(fill(one.get("from"))).is_file()
            command += ["--params-file", fill(one.get("from"))]
        else:
            command += ["-p", f"{one.get('name')}:={fill(one.get('value'))}"]
    return command


@pytest.fixture
def start(ros, tmp_path):
    """Start the node by its launch file and a file of parameters; end it by a signal."""
    running, robots = [], []
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(MAP))

    class Running:
        def __init__(self, now=START, quality=SENSOR, **parameters):
            usual = {"map_file": str(tmp_path / "map.yaml"), "save_seconds": 1e6}
            given = {"/**": {"ros__parameters": {**usual, **parameters}}}
            (tmp_path / "memory.yaml").write_text(yaml.safe_dump(given))
            topics = {"camera_info": "/eye/camera_info", "depth": "/eye/depth"}
            command = read_launch(
                params_file=str(tmp_path / "memory.yaml"),
                use_sim_time="true",
                detections="/detector/found",
                **topics,
            )
            self.process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
            )
            running.append(self.process)
            kind = parameters.get("detections_type", "Detection2DArray")
            self.robot = Robot(now, kind, quality)
            robots.append(self.robot)

        def end(self, number=signal.SIGTERM):
            """End it, and return its status and what it said."""
            robots.remove(self.robot)
            self.robot.leave()
            self.process.send_signal(number)
            said, _ = self.process.communicate(timeout=PATIENCE)
            running.remove(self.process)
            return self.process.returncode, said

    yield Running
    for robot in robots:
        robot.leave()
    for process in running:
        process.kill()
        process.communicate()


def test_a_look_gives_answers_poses_and_markers(start, tmp_path):
    node = start(memory_file=str(tmp_path / "home.sgm"))
    robot = node.robot
    robot.connect()
    before = robot.rank()
    assert list(before.names) == ["table 1 in kitchen"]
    assert np.isnan(before.positions).all()
    for pose in POSES:
        robot.show(pose)
    assert "in view now at 2.11, 0.3, 0.75" in robot.rank().text
    robot.look()
    after = robot.rank()
    assert after.probabilities[0] > max(0.9, before.probabilities[0])
    assert after.elsewhere == pytest.approx(1 - sum(after.probabilities))
    np.testing.assert_allclose(after.positions, MUG.center, atol=0.03)
    found = robot.ask(Search, description="the mug")
    assert (found.is_over, found.furniture, found.name) == (False, 0, "table 1 in kitchen")
    assert found.pose.header.frame_id == "map"
    at, turn = found.pose.pose.position, found.pose.pose.orientation
    yaw = 2 * np.arctan2(turn.z, turn.w)
    aim = np.array(MUG.center[:2]) - (at.x, at.y)
    assert 0.4 < np.linalg.norm(aim) < 2.0
    np.testing.assert_allclose((np.cos(yaw), np.sin(yaw)), aim / np.linalg.norm(aim), atol=0.05)
    robot.wait(lambda: robot.poses_next and robot.beliefs)
    assert robot.poses_next[-1] == found.pose
    assert [mark.ns for mark in robot.beliefs[-1].markers] == ["", "belief", "text"]
    assert "description must" in robot.rank("").text  # and it lives on
    assert robot.ask(Search, description="").is_over
    status, said = node.end()
    assert (status, "Traceback" in said) == (0, False), said
    assert "looked at table 1 in kitchen: 1 things" in said
    assert SceneGraphMemory.load(tmp_path / "home.sgm").last_seen("mug").is_there


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_night_off_is_a_night(start, tmp_path, number):
    """From 20:00 to 7:00; the question comes before any message."""
    file = str(tmp_path / "home.sgm")
    node = start(memory_file=file)
    node.robot.connect()
    node.robot.look()
    status, said = node.end(number)
    assert (status, "Traceback" in said) == (0, False), said
    memory = SceneGraphMemory.load(file)
    assert memory.clock.start.replace(second=0) == datetime(2026, 11, 16, 20, 0)
    assert memory.time == 0
    node = start(START + 11 * HOUR, memory_file=file, map_file="")
    node.robot.connect()
    assert "yesterday at 20:0" in node.robot.rank().text
    node.robot.tick(8 * HOUR)  # no frame comes
    assert "yesterday at 20:0" in node.robot.rank().text
    node.robot.look(things=())
    assert "not there at 15:0" in node.robot.rank().text
    status, said = node.end(number)
    assert (status, "Traceback" in said) == (0, False), said
    assert SceneGraphMemory.load(file).time == 19 * 6


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_visit_that_goes_on(start, tmp_path, number):
    """The end of the visit is a line of the log like any other, and no error of ROS."""
    node = start(memory_file=str(tmp_path / "home.sgm"), memoryfile="home.sgm")
    node.robot.connect()
    for pose in POSES:
        node.robot.show(pose)
    assert "in view now" in node.robot.rank().text
    status, said = node.end(number)
    assert (status, "Traceback" in said, "Failed" in said) == (0, False, False), said
    assert "looked at table 1 in kitchen: 1 things" in said
    assert "ready, and listens to /eye/camera_info, /eye/depth, /detector/found" in said
    assert "got 'memoryfile', which is ignored. Did you mean memory_file?" in said
    assert SceneGraphMemory.load(tmp_path / "home.sgm").last_seen("mug").is_there


def test_what_nobody_publishes_is_said(start):
    node = start(compressed_depth=True, ignore=[])
    node.robot.wait(node.robot.clients[Rank].service_is_ready)
    for _ in range(30):
        node.robot.tick(1.0)
    status, said = node.end()
    assert (status, "Traceback" in said) == (0, False), said
    wanted = "/eye/depth must have a publisher of sensor_msgs/msg/CompressedImage, got "
    assert said.count(f"{wanted}sensor_msgs/msg/Image. Start it, or name its topic.") == 1, said
    assert "/eye/camera_info must" not in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seconds", [0.3, 1.0, 2.0, 3.0])
def test_a_signal_while_it_starts_is_no_error(start, number, seconds):
    node = start()
    time.sleep(seconds)
    status, said = node.end(number)
    # Before Python runs its own code, a signal ends the process as it ends any other.
    assert "Traceback" not in said or seconds < 1, said
    assert status in ((0, -number, 1) if seconds < 1 else (0, -number)), said


@pytest.mark.parametrize(
    "quality", [QoSProfile(depth=10, reliability=kind) for kind in
                (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)]
)  # fmt: skip
def test_sensors_of_either_quality_are_heard(start, quality):
    node = start(quality=quality)
    node.robot.connect()
    node.robot.look()
    assert "seen here" in node.robot.rank().text


def test_transforms_may_be_late_missing_and_jump(start):
    node = start()
    robot = node.robot
    robot.connect()
    for pose in POSES:
        robot.show(pose, tf=False)
    robot.tick(60.0)
    assert "seen here" not in robot.rank().text.replace("not seen here", "")
    robot.spin(1.0)
    for number, pose in enumerate(look_around(TABLE.center)[:10]):
        robot.show(pose, late=0.15)
        if number % 3 == 2:  # the localisation jumps to the other side of the home, and back
            far = look_around((-6.0, 5.0, 0.0))[number]
            robot.show(far, things=(), solid=())
    assert "in view now at 2.11, 0.3, 0.75" in robot.rank().text
    robot.look()
    assert robot.rank().probabilities[0] > 0.9
    status, said = node.end()
    assert (status, "Traceback" in said) == (0, False), said
    assert "transforms must connect the camera's frame 'camera' with 'map'" in said


def test_a_whole_map_in_every_message_is_not_seen(start):
    """Of a mug that is gone, and of one in view, in messages of boxes in space."""
    node = start(detections_type="Detection3DArray")
    robot = node.robot
    robot.connect()
    robot.look()
    assert robot.rank().probabilities[0] > 0.9
    robot.tick(HOUR)
    bodies = [("mug", MUG), ("cup", put_on(TABLE, -0.1, -0.3))]
    for pose in POSES:
        now = robot.now
        robot.show(pose, things=(), solid=(TABLE, FLOOR, bodies[1][1]))
        robot.to["detections"].publish(make_detections_3d(now + 0.01, bodies))
        robot.to["depth"].publish(
            make_depth(now + 0.01, render([TABLE, FLOOR, bodies[1][1]], pose))
        )
        robot.tick(0.05)
    robot.look(things=(("cup", bodies[1][1]),))
    assert "not there" in robot.rank("mug").text
    assert robot.rank("cup").probabilities[0] > 0.9


def test_parameters_say_what_they_are_and_the_file_has_all(start):
    node = start()
    node.robot.connect()
    listed = node.robot.ask(ListParameters).result.names
    file = yaml.safe_load((ROS / "config" / "memory.yaml").read_text("utf-8"))
    written = file["/**"]["ros__parameters"]
    own = [name for name in listed if not name.startswith(("use_sim_time", "start_type", "qos_"))]
    assert sorted(own) == sorted(written)
    told = node.robot.ask(DescribeParameters, names=own).descriptors
    assert all(one.description and one.read_only for one in told)
    assert node.end()[0] == 0


def test_the_readme_leads_from_the_clone_to_an_answer(tmp_path):
    """The block that needs no ROS 2 on the machine, as it is typed."""
    page = (ROS.parent / "README.md").read_text("utf-8")
    (typed,) = [
        block
        for block in re.findall(r"```bash\n(.*?)```", page, re.DOTALL)
        if block.startswith("make ros-test")
    ]
    made, _, typed = typed.partition("\n")  # the first line runs this test
    assert "-k readme" in made
    (tmp_path / ".ros").symlink_to(ROS.parents[1] / ".ros")
    command = ["bash", "-e", "-c", typed]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert re.search(r"red mug\n +\d+% +desk in study", done.stdout), done.stdout


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"map_file": "/nowhere/map.yaml"}, "No such file or directory"),
        ({"detections_type": "PointCloud2"}, "detections_type must be one of Detection2DArray"),
        ({"detections_type": "DetectionArray"}, "package yolo_msgs must be in the workspace for"),
        ({"scene_graph": True}, "package spark_dsg must be installed"),  # of hydra_msgs: as above
        ({"memory_file": __file__}, "memory file must be one that SceneGraphMemory wrote"),
        ({"step_seconds": 0.1}, "step_seconds must be at least 1"),
        ({"save_seconds": 0.0}, "save_seconds must be at least 1"),
        ({"map_file": __file__}, "file of a parameter must be YAML"),
        ({"step_seconds": 600}, "'step_seconds'"),  # a whole number where rclpy wants 600.0
    ],
)
def test_a_wrong_parameter_is_one_line(start, parameters, message):
    node = start(**parameters)
    said, _ = node.process.communicate(timeout=PATIENCE)
    assert (node.process.returncode, "Traceback" in said) == (1, False), said
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert message in errors[0]


@pytest.mark.parametrize(
    "arguments", [["--params-file", "/nowhere/memory.yaml"], ["-r", "__node:=a-b"]]
)
def test_arguments_that_ros_cannot_read_are_one_error(ros, arguments):
    command = [*read_launch()[:2], *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, "Traceback" in done.stderr) == (1, False), done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert arguments[1] in line

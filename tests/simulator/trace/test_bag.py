import shutil
import tracemalloc
from functools import cache
from types import SimpleNamespace as Message

import numpy as np
import pytest

from sgm import Bayesian, Finder, SceneGraphMemory
from sgm.eyes.__main__ import main as draw_main
from sgm.memory.memory_event import read_events
from simulator.trace.__main__ import main
from simulator.trace.importers.bag import BagOptions, load_home_map, read_bag
from simulator.trace.importers.bag_messages import DEFINITIONS
from simulator.trace.trace import load_trace
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, look_around, put_on, render
from tests.sgm.ros.messages import (
    make_camera_info,
    make_compressed_depth,
    make_depth,
    make_detections,
    make_detections_3d,
    make_quaternion,
    make_transform,
    make_yolo,
)
from tests.sgm.ros.test_feed import find_box

rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed: extra bag")
typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed: extra bag")

START = 1_760_000_000  # 2025-10-09 08:53:20 UTC
MAP = f"""
frame: map
rooms: [kitchen]
furniture:
  - {{name: table, room: kitchen, center: {list(TABLE.center)}, size: {list(TABLE.size)}}}
"""
TOPICS = {
    "/detections": "vision_msgs/msg/Detection2DArray",
    "/yolo": "yolo_msgs/msg/DetectionArray",
    "/all": "vision_msgs/msg/Detection2DArray",
    "/in_map": "vision_msgs/msg/Detection3DArray",
    "/depth/compressedDepth": "sensor_msgs/msg/CompressedImage",
    "/boxes": "vision_msgs/msg/Detection3DArray",
    "/camera/depth/image_raw": "sensor_msgs/msg/Image",
    "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}


@cache
def _make_store():
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        store.register(typesys.get_types_from_msg(text, name))
    return store


def _fill(store, kind, value):
    """Make a message of a type from a plain object; fields that it lacks are 0."""
    fields = {}
    for name, (number, about) in store.get_msgdef(kind).fields:
        own = getattr(value, name, None)
        if number.name == "BASE":
            usual = "" if about[0] == "string" else 0
            fields[name] = usual if own is None else type(usual)(own) if usual == "" else own
        elif number.name == "NAME":
            fields[name] = _fill(store, about, own)
        else:  # an array, or a sequence
            (inner, what), length = about
            if inner.name == "NAME":
                fields[name] = [_fill(store, what, one) for one in own or []]
            else:
                array = np.zeros(length) if own is None else np.asarray(own)
                numbers = {"float64": np.float64, "uint8": np.uint8}[what[0]]
                fields[name] = array.astype(numbers)
    return store.types[kind](**fields)


@pytest.fixture(scope="module")
def write_once(tmp_path_factory):
    """What writes a bag as `write_recording` does, of each kind once."""
    return cache(lambda *kind: write_recording(tmp_path_factory.mktemp("bags") / "bag", *kind))


@pytest.fixture
def write_bag(tmp_path, write_once):
    """Write a bag of a robot that looks at a table twice; the second time it is empty."""

    def write(storage="SQLITE3", leaves_out=(), cut=None):
        folder = shutil.copytree(write_once(storage, tuple(leaves_out), cut), tmp_path / "bag")
        (tmp_path / "map.yaml").write_text(MAP)
        return folder

    return write


def write_recording(folder, storage, leaves_out=(), cut=None, *, is_gone=True):
    """Write a bag; in its second visit the mug is gone, or still there."""
    store = _make_store()
    plugin = getattr(rosbag2.StoragePlugin, storage)
    poses = look_around(TABLE.center)[:10]
    mug = put_on(TABLE, 0.1, 0.3)
    with rosbag2.Writer(folder, version=9, storage_plugin=plugin) as writer:
        lines = {
            topic: writer.add_connection(topic, kind, typestore=store)
            for topic, kind in TOPICS.items()
            if topic not in leaves_out
        }

        def put(topic, time, message):
            if topic in lines:
                data = store.serialize_cdr(_fill(store, TOPICS[topic], message), TOPICS[topic])
                if cut is not None and topic == cut:
                    data = data[: len(data) // 2]
                writer.write(lines[topic], round(time * 1e9), data)

        still = make_transform(START, "map", "odom", (0, 0, 0))
        put("/tf_static", START, Message(transforms=[still]))
        put("/camera/camera_info", START, make_camera_info(CAMERA))
        for visit, things in enumerate(([("mug", mug)], [] if is_gone else [("mug", mug)])):
            for number, pose in enumerate(poses):
                time = START + 700 * visit + 0.2 * number
                turn = make_quaternion(pose.rotation)
                bodies = [body for _, body in things]
                put(
                    "/tf",
                    time,
                    Message(
                        transforms=[make_transform(time, "odom", "camera", pose.position, turn)]
                    ),
                )
                depth = render([TABLE, FLOOR, *bodies], pose)
                put("/camera/depth/image_raw", time, make_depth(time, depth))
                put("/depth/compressedDepth", time, make_compressed_depth(time, depth))
                rows = [(name, 0.9, find_box(body, pose)) for name, body in things]
                put("/detections", time, make_detections(time, rows))
                put("/yolo", time, make_yolo(time, rows))
                named = [("dining_table", 0.9, find_box(TABLE, pose))]
                put("/all", time, make_detections(time, [*rows, *named]))
                rows = [(name, 0.9, body.center) for name, body in things]
                put("/in_map", time, make_detections_3d(time, rows, frame="map"))
                rows = [
                    (name, 0.9, pose.to_camera(np.array([body.center]))[0]) for name, body in things
                ]
                put("/boxes", time, make_detections_3d(time, rows))
    return folder


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
@pytest.mark.parametrize("detections", ["/detections", "/boxes"])
def test_a_bag_becomes_a_memory(write_bag, tmp_path, storage, detections):
    folder = write_bag(storage)
    home = load_home_map(tmp_path / "map.yaml")
    options = BagOptions(detections=detections, utc_hours=2)
    looks = read_bag(folder, home, options, file=tmp_path / "looks.sgm")
    assert looks.num_looks == 2
    seen = looks.memory.last_seen("mug")
    assert (seen.relation, seen.times_seen, seen.is_there) == ("onTop", 1, False)
    assert looks.memory.time == 1  # of 600 s
    assert f"{looks.memory.clock.get_time(0):%Y-%m-%d %H:%M:%S}" == "2025-10-09 10:53:20"
    kinds = [line.kind for line in read_events(tmp_path / "looks.sgm")]
    assert kinds == ["start", "room", "furniture", "look", "step", "look"]
    assert looks.counts["frames"] == 20
    assert not [name for name in looks.counts if "cannot" in name]


@pytest.mark.parametrize(
    ("detections", "depth"),
    [
        ("/yolo", "/camera/depth/image_raw"),
        ("/detections", "/depth/compressedDepth"),
        ("/in_map", "/camera/depth/image_raw"),
    ],
)
def test_what_robots_publish_is_read(write_bag, tmp_path, detections, depth):
    options = BagOptions(detections=detections, depth=depth)
    looks = read_bag(write_bag(), load_home_map(tmp_path / "map.yaml"), options)
    assert looks.num_looks == 2
    seen = looks.memory.last_seen("mug")
    assert (seen.relation, seen.times_seen, seen.is_there) == ("onTop", 1, False)
    assert looks.counts["depth images"] == looks.counts["frames"] == 20
    assert not [name for name in looks.counts if "cannot" in name or "without" in name]


def test_a_bag_without_a_map_becomes_a_memory_that_answers(write_bag, tmp_path, capsys):
    """One command; the map that it draws is written, corrected by a person, and taken again."""
    folder, memory = write_bag(), tmp_path / "home.sgm"
    areas = tmp_path / "areas.yaml"
    areas.write_text("kitchen: [[-3, -3], [5, -3], [5, 3], [-3, 3]]")
    command = ["import", "bag", str(folder), "--memory", str(memory)]
    command += ["--detections", "/all", "--areas", str(areas)]
    assert main(command) == 0
    assert "1 map: furniture found" in capsys.readouterr().out
    home = SceneGraphMemory.load(memory)
    seen = home.last_seen("mug")
    assert home.describe(seen.furniture) == "dining table in kitchen"
    assert not seen.is_there  # the second visit showed that it is gone
    place = Finder(Bayesian()).rank(home, "mug")
    assert place[0].name == "dining table in kitchen"

    drawn = tmp_path / "drawn.yaml"
    assert draw_main(["map", str(memory), "--out", str(drawn)]) == 0
    text = drawn.read_text()
    (tmp_path / "drawn.yaml").write_text(text.replace('"dining table"', '"our table"', 1))
    assert draw_main(["correct", str(memory), "--map", str(drawn)]) == 0
    assert "1 pieces of furniture renamed" in capsys.readouterr().out
    assert SceneGraphMemory.load(memory).describe(seen.furniture) == "our table in kitchen"
    looks = read_bag(folder, load_home_map(drawn), BagOptions(detections="/detections"))
    assert looks.memory.describe(0) == "our table in kitchen"
    assert looks.memory.last_seen("mug").times_seen == 1


def test_a_robot_without_a_frame_map_and_with_names_of_its_own(write_bag, tmp_path, capsys):
    folder, memory, names = write_bag(), tmp_path / "home.sgm", tmp_path / "names.yaml"
    command = ["import", "bag", str(folder), "--detections", "/all", "--memory", str(memory)]
    assert main([*command, "--map_frame", "world"]) == 0
    out = capsys.readouterr().out
    assert "0 looks" in out
    assert "note: transforms must connect the camera's frame 'camera' with 'world', got" in out
    names.write_text("workbench: [dining table]")
    memory.unlink()
    assert main([*command, "--map_frame", "odom", "--furniture_names", str(names)]) == 0
    assert "note" not in capsys.readouterr().out
    home = SceneGraphMemory.load(memory)
    assert [row.label for row in home.layout.furniture.values()] == ["dining table"]
    names.write_text("bench: 1")
    assert main([*command, "--furniture_names", str(names)]) == 1
    assert "names of furniture must be aliases by label" in capsys.readouterr().err
    assert main([*command, "--furniture_names", str(tmp_path / "none.yaml")]) == 1
    assert "furniture_names must be a file that can be read" in capsys.readouterr().err


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_storages_need_no_metadata(write_bag, tmp_path, storage):
    folder = write_bag(storage)
    (folder / "metadata.yaml").unlink()
    (file,) = folder.iterdir()
    home = load_home_map(tmp_path / "map.yaml")
    for path in (folder, file):
        assert read_bag(path, home).num_looks == 2
    whole = file.read_bytes()
    for broken in (b"nothing", whole[: len(whole) // 2]):
        file.write_bytes(broken)
        with pytest.raises(ValueError, match=r"bag must be .*that rosbags reads") as raised:
            read_bag(folder, home)
        remedy = "`mcap recover`" if storage == "MCAP" else "`ros2 bag reindex`"
        assert str(raised.value).endswith(f"or {remedy}.")


def test_the_only_topic_of_a_type_need_not_be_named(write_bag, tmp_path):
    leaves_out = ["/detections", "/all", "/boxes", "/in_map", "/camera/depth/image_raw"]
    looks = read_bag(write_bag(leaves_out=leaves_out), load_home_map(tmp_path / "map.yaml"))
    assert looks.num_looks == 2
    assert looks.topics["detections"] == "/yolo"
    assert looks.topics["depth"] == "/depth/compressedDepth"
    assert "/yolo (detections)" in looks.summarise()


def test_the_command_writes_memory_and_trace(write_bag, tmp_path, capsys):
    folder = write_bag()
    memory, out = tmp_path / "home.sgm", tmp_path / "trace"
    arguments = ["import", "bag", str(folder), "--map", str(tmp_path / "map.yaml")]
    everything = ["--memory", str(memory), "--out", str(out)]
    assert main([*arguments, *everything]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("2 looks, 1 things, 1 pieces of furniture, 1 time steps\ntopics: ")
    assert SceneGraphMemory.load(memory).last_seen("mug").times_seen == 1
    trace = load_trace(out)
    assert [event.description for event in trace.events] == ["mug", "mug"]  # it came, and went
    assert trace.layout.furniture[0].box is not None
    assert main([*arguments, *everything]) == 1
    assert "memory must be a new file" in capsys.readouterr().err
    assert main(arguments) == 1
    assert "import must make something" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("leaves_out", "message"),
    [
        (
            ["/detections", "/all", "/boxes", "/yolo", "/in_map"],
            "bag must have the topic /detections of type .*got no such topic",
        ),
        (["/tf"], "bag must have the topic /tf of type"),
        (
            ["/camera/depth/image_raw", "/depth/compressedDepth"],
            "bag must have the topic /camera/depth/image_raw",
        ),
    ],
)
def test_what_a_bag_lacks_is_said_in_one_line(write_bag, tmp_path, leaves_out, message):
    folder = write_bag(leaves_out=leaves_out)
    home = load_home_map(tmp_path / "map.yaml")
    with pytest.raises(ValueError, match=message) as error:
        read_bag(folder, home)
    assert "/camera/camera_info (sensor_msgs/msg/CameraInfo)" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_topic_of_another_type_is_said(write_bag, tmp_path):
    home = load_home_map((write_bag(), tmp_path / "map.yaml")[1])
    with pytest.raises(ValueError, match="got sensor_msgs/msg/CameraInfo"):
        read_bag(tmp_path / "bag", home, BagOptions(detections="/camera/camera_info"))


def test_boxes_in_space_need_no_depth(write_bag, tmp_path):
    folder = write_bag(leaves_out=["/camera/depth/image_raw", "/depth/compressedDepth"])
    looks = read_bag(folder, load_home_map(tmp_path / "map.yaml"), BagOptions(detections="/boxes"))
    assert looks.num_looks == 2
    assert looks.memory.last_seen("mug").times_seen == 1


def test_messages_that_were_cut_are_counted(write_bag, tmp_path):
    folder = write_bag(cut="/detections")
    looks = read_bag(folder, load_home_map(tmp_path / "map.yaml"))
    assert looks.counts["messages that cannot be read"] == 20
    assert looks.num_looks == 0


@pytest.mark.slow
@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_bags_that_were_altered_end_in_one_line(write_bag, tmp_path, storage):
    folder = write_bag(storage)
    home = load_home_map(tmp_path / "map.yaml")
    (file,) = [path for path in folder.iterdir() if path.name != "metadata.yaml"]
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(12):
        broken = bytearray(whole)
        for at in rng.integers(len(whole), size=40):
            broken[at] = int(rng.integers(256))
        file.write_bytes(bytes(broken[: int(rng.integers(len(whole) // 2, len(whole)))]))
        try:
            read_bag(folder, home)
        except ValueError as error:
            assert "\n" not in str(error)  # noqa: PT017 - it may be read, too


@pytest.mark.slow
@pytest.mark.parametrize("length", [2**31 - 1, 2**40, 2**63 - 1])
def test_a_record_takes_no_more_memory_than_the_file_has_bytes(write_bag, length):
    """The first record follows eight bytes of magic and its number: length, content."""
    folder = write_bag("MCAP")
    (file,) = folder.glob("*.mcap")
    content = bytearray(file.read_bytes())
    content[9:17] = length.to_bytes(8, "little")
    file.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"bag must be .*, got .*expected \d+ bytes"):
        read_bag(folder)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 50 << 20


@pytest.mark.slow
@pytest.mark.parametrize("name", ["zstd", "lz4"])
def test_a_chunk_takes_no_more_memory_than_it_says(write_bag, name):
    """What rosbags does with every chunk of MCAP, given one of a few kB that unpacks to 64 MB."""
    read_bag(write_bag("MCAP"))
    storage = pytest.importorskip("rosbags.rosbag2.storage_mcap")
    pack = {"zstd": storage.zstd.compress, "lz4": pytest.importorskip("lz4.frame").compress}[name]
    bomb, text = pack(bytes(64 << 20)), pack(b"a message")
    assert storage.decompress(text, name, 9, 0) == b"a message"
    for says, message in (
        (1000, "mismatch"), (8, "mismatch"), (2**40, "at most 268435456 bytes, got 1099511627776"),
        (-1, "at most 268435456 bytes, got -1"),
    ):  # fmt: skip
        tracemalloc.start()
        with pytest.raises(Exception, match=message):
            storage.decompress(text if says == 8 else bomb, name, says, 0)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert most < 1 << 20


def test_what_is_no_bag(write_bag, tmp_path, capsys):
    folder = write_bag()
    command = ["import", "bag", "--map", str(tmp_path / "map.yaml"), "--memory", "x.sgm"]
    assert main([*command, str(tmp_path)]) == 1
    assert "bag must be a folder with metadata.yaml, or files" in capsys.readouterr().err
    text = (folder / "metadata.yaml").read_text()
    for other, message in (
        (text.replace("compression_mode: ''", "compression_mode: FILE"), "must not be compressed"),
        ("a: [", "metadata.yaml of a bag must be YAML"),
        ("a: 1", "bag must be one of ROS 2"),
    ):
        assert other != text
        (folder / "metadata.yaml").write_text(other)
        assert main([*command, str(folder)]) == 1
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    shutil.rmtree(folder)


def test_maps_that_cannot_be_read(tmp_path, capsys):
    assert main(["import", "bag", "x", "--map", str(tmp_path / "none.yaml"), "--out", "y"]) == 1
    assert "map must be a file that can be read" in capsys.readouterr().err


def test_help_of_import_names_bags(capsys):
    with pytest.raises(SystemExit):
        main(["import", "--help"])
    assert "import bag --help" in " ".join(capsys.readouterr().out.split())

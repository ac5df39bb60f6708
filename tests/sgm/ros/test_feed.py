from types import SimpleNamespace as Message

import numpy as np
import pytest

from sgm import Bayesian, Finder, SceneGraphMemory
from sgm.eyes import Box, LookBuilder, Pose
from sgm.ros import CameraFeed, HomeMap, LiveMemory
from sgm.ros.message_readings import (
    list_frames,
    read_depth_image,
    read_detections,
    read_uncertainty,
)
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

MAP = {
    "rooms": ["kitchen"],
    "furniture": [
        {
            "name": "table 1",
            "room": "kitchen",
            "center": list(TABLE.center),
            "size": list(TABLE.size),
            "yaw": TABLE.yaw,
        }
    ],
}


def find_box(box, pose):
    """Left, top, right, bottom of a box in the image."""
    corners = box.to_map(
        np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        * np.array(box.size)
        / 2
    )
    pixels = CAMERA.project(pose.to_camera(corners))
    return (*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())


def play(feed, poses, things=(), *, is_3d=False, encoding="16UC1", start=100.0, leaves_out=()):
    """Hand on the messages of a robot that looks from some poses, a fifth of a second apart."""
    feed.take_camera(make_camera_info(CAMERA))
    bodies = [body for _, body in things]
    for number, pose in enumerate(poses):
        time = start + 0.2 * number
        turn = make_quaternion(pose.rotation)
        rows = [(name, 0.9, find_box(body, pose)) for name, body in things]
        message = make_detections(time, rows)
        if is_3d:
            centers = pose.to_camera(np.array([body.center for body in bodies]).reshape(-1, 3))
            rows = [(name, 0.9, at) for (name, _), at in zip(things, centers, strict=True)]
            message = make_detections_3d(time, rows)
        feed.take_detections(message)  # before its depth and its transform
        if "depth" not in leaves_out:
            feed.take_depth(make_depth(time, render([TABLE, FLOOR, *bodies], pose), encoding))
        if "tf" not in leaves_out:
            transform = make_transform(time, "map", "camera", pose.position, turn)
            feed.take_transforms(Message(transforms=[transform]))
    feed.finish()


@pytest.mark.parametrize(
    ("is_3d", "encoding"), [(False, "16UC1"), (False, "32FC1"), (True, "16UC1")]
)
def test_messages_become_a_look(is_3d, encoding):
    mug = put_on(TABLE, 0.1, 0.3)
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder)
    play(feed, look_around(TABLE.center)[:12], [("mug", mug)], is_3d=is_3d, encoding=encoding)
    (look,) = builder.finish()
    assert look.num_frames == 12
    assert [(one.description, one.relation) for one in look.seen] == [("mug", "onTop")]
    assert look.seen[0].confidence > 0.9
    assert look.coverage["onTop"] > 0.5
    assert feed.counts["frames"] == 12
    assert not [name for name in feed.counts if "cannot" in name]


def test_frames_without_a_transform_or_depth_are_counted():
    poses = look_around(TABLE.center)[:4]
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder)
    play(feed, poses, leaves_out=["tf"])
    assert builder.counts == {"frames": 4, "no transform": 4}
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder)
    play(feed, poses, leaves_out=["depth"])
    assert feed.counts["frames without depth"] == 4
    (look,) = builder.finish()
    assert look.coverage["onTop"] <= 0.7  # what is in the way is not known


def test_a_frame_waits_no_longer_than_it_may():
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder, uses_depth=False, patience=0.5)
    feed.take_camera(make_camera_info(CAMERA))
    feed.take_transforms(Message(transforms=[make_transform(10.0, "map", "camera", (0, 0, 1))]))
    feed.take_detections(make_detections(10.3, []))
    assert "frames" not in feed.counts  # a later transform may come
    feed.take_transforms(Message(transforms=[make_transform(10.35, "map", "camera", (0, 0, 1))]))
    assert feed.counts["frames"] == 1
    feed.take_detections(make_detections(10.4, []))
    feed.take_detections(make_detections(11.0, []))
    assert feed.counts["frames"] == 2
    assert builder.counts["frames"] == 2


def test_a_stale_transform_is_dropped_by_the_gate():
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder, uses_depth=False)
    feed.take_camera(make_camera_info(CAMERA))
    feed.take_transforms(Message(transforms=[make_transform(10.0, "map", "camera", (0, 0, 1))]))
    feed.take_detections(make_detections(11.0, []))
    feed.finish()
    assert builder.counts == {"frames": 1, "transform too old": 1}


def test_broken_messages_are_counted_and_never_raised():
    feed = CameraFeed(LookBuilder({7: TABLE}))
    feed.take_camera(Message(k=[0.0] * 9, width=10, height=10))
    feed.take_camera(Message())
    feed.take_depth(Message(header=None))
    feed.take_depth(Message(**{**vars(make_depth(1.0, np.ones((4, 4)))), "encoding": "rgb8"}))
    broken = make_transform(1.0, "map", "camera", (np.nan, 0, 0))
    feed.take_transforms(Message(transforms=[broken]))
    feed.take_detections(Message())
    feed.take_pose(Message(pose=Message(covariance=[1.0])))
    feed.take_detections(make_detections(1.0, []))
    feed.finish()
    assert feed.counts == {
        "camera infos that cannot be read": 2,
        "depth images that cannot be read": 2,
        "transforms that cannot be read": 1,
        "detections that cannot be read": 1,
        "poses that cannot be read": 1,
        "messages of detections": 1,
        "frames before any camera info": 1,
    }


def test_detections_that_say_nothing_are_counted_each():
    builder = LookBuilder({0: TABLE})
    feed = CameraFeed(builder, uses_depth=False)
    feed.take_camera(make_camera_info(CAMERA))
    feed.take_transforms(Message(transforms=[make_transform(100, "map", "camera", (0, 0, 1))]))
    good = ("Tasse", 0.9, (10, 10, 20, 20))
    nan = float("nan")
    rows = [good, ("", 0.9, (1, 1, 2, 2)), ("a", nan, (1, 1, 2, 2)), ("a", 0.9, (nan, 1, 2, 2))]
    message = make_detections(100, [*rows, good])
    message.detections[-1].results.clear()
    feed.take_detections(message)
    feed.finish()
    assert feed.counts["detections without a name or a score"] == 3
    assert feed.counts["detections whose box is unknown"] == 1
    assert builder.counts["detections"] == 1


def test_a_map_frame_that_is_not_there_is_said():
    feed = CameraFeed(LookBuilder({0: TABLE}), uses_depth=False)
    feed.take_camera(make_camera_info(CAMERA))
    assert feed.find_gap() == ""
    feed.take_transforms(Message(transforms=[make_transform(100, "odom", "camera", (0, 0, 1))]))
    feed.take_detections(make_detections(100, []))
    feed.finish()
    assert "camera's frame 'camera' with 'map', got 'odom, camera'" in feed.find_gap()
    feed.take_transforms(Message(transforms=[make_transform(101, "map", "odom", (0, 0, 0))]))
    feed.take_transforms(Message(transforms=[make_transform(101, "odom", "camera", (0, 0, 1))]))
    feed.take_detections(make_detections(101, []))
    feed.finish()
    assert feed.find_gap() == ""


def test_a_camera_or_depth_that_is_not_there_is_said():
    feed = CameraFeed(LookBuilder({0: TABLE}))
    feed.take_transforms(Message(transforms=[make_transform(90, "map", "camera", (0, 0, 1))]))

    def show(time, size=None, late=0.0):
        feed.take_detections(make_detections(time, []))
        if size is not None:
            feed.take_depth(make_depth(time + late, np.ones(size)))
        feed.finish()

    show(91)
    assert "must come after a CameraInfo, got none." in feed.find_gap()
    feed.take_camera(Message(k=None))
    assert "must come after a CameraInfo, got 1 that cannot be read." in feed.find_gap()
    feed.take_camera(make_camera_info(CAMERA))
    assert feed.find_gap() == ""
    show(92)
    assert "must have depth images of the camera's size and their time, got none." in (
        feed.find_gap()
    )
    show(93, (CAMERA.height, CAMERA.width), late=0.3)
    assert "got none within 0.05 s of the detections." in feed.find_gap()
    show(95, (4, 3))
    assert "got some of another size." in feed.find_gap()
    show(97, (CAMERA.height, CAMERA.width))
    assert feed.find_gap() == ""
    show(99)
    assert feed.find_gap() == ""


def test_depth_images_by_hand():
    depth = np.array([[1.0, 2.5], [0.0, 4.0]])
    for encoding in ("16UC1", "32FC1"):
        for is_bigendian in (0, 1):
            message = make_depth(0.0, depth, encoding, is_bigendian, padding=6)
            np.testing.assert_allclose(read_depth_image(message), depth)
    message = make_depth(0.0, depth)
    message.data = message.data[:-1]
    with pytest.raises(ValueError, match=r"must have 8 bytes, got 7\. It was cut short"):
        read_depth_image(message)
    message = make_depth(0.0, depth)
    message.height = 1 << 30
    with pytest.raises(ValueError, match="must have 1 to 33554432 pixels"):
        read_depth_image(message)
    message.encoding = "bgr8"
    with pytest.raises(ValueError, match="one of 16UC1, mono16, 32FC1, got 'bgr8'"):
        read_depth_image(message)


def test_names_and_numbers_of_classes():
    message = make_detections(0.0, [("3", 0.5, (0, 0, 4, 4)), ("coffee_mug", 2.0, (0, 0, 4, 4))])
    message.detections.append(Message(results=[], bbox=message.detections[0].bbox, id=""))
    names = ["person", "cat", "dog", "cup"]
    found = read_detections(message, names)
    assert [(one.name, one.score) for one in found] == [("cup", 0.5), ("coffee mug", 1.0)]
    assert [one.name for one in read_detections(message, {"3": "mug"})] == ["mug", "coffee mug"]
    assert found[0].box == (0, 0, 4, 4)


def test_centers_of_the_camera_are_turned_into_the_map():
    """2 m ahead of an optical frame at (1, 0, 1) that looks along +x is (3, 0, 1)."""
    pose = Pose.look_at((1, 0, 1), (2, 0, 1))
    to_map = np.eye(4)
    to_map[:3, :3], to_map[:3, 3] = pose.rotation, pose.position
    message = make_detections_3d(0.0, [("mug", 0.8, (0, 0, 2))], size=(0.1, 0.2, 0.3))
    (mug,) = read_detections(message, to_map={"camera": to_map}.get)
    np.testing.assert_allclose(mug.center, (3, 0, 1), atol=1e-12)
    np.testing.assert_allclose(mug.size, (0.3, 0.1, 0.2), atol=1e-12)  # z is ahead, y is down
    message = make_detections_3d(0.0, [("mug", 1, (0, 0, 2))], size=(0, 0, 0))
    (mug,) = read_detections(message, to_map={"camera": to_map}.get)
    assert mug.size is None
    assert read_detections(message) == []  # where the frame is unknown


def test_boxes_of_yolo_in_space_count_where_they_have_a_size():
    rows = [("mug", 0.8, (0, 0, 4, 4)), ("red_cup", 0.7, (1, 2, 3, 5))]
    flat, other = read_detections(make_yolo(0.0, rows))
    assert (flat.name, flat.score, flat.box, flat.center) == ("mug", 0.8, (0, 0, 4, 4), None)
    assert (other.name, other.box) == ("red cup", (1, 2, 3, 5))
    boxes = [((1, 2, 3), (0.1, 0.1, 0.1)), ((0, 0, 0), (0, 0, 0))]
    message = make_yolo(0.0, rows, boxes_3d=boxes, frame_3d="odom")
    assert list_frames(message) == {"odom"}
    shifted = np.eye(4)
    shifted[:3, 3] = 10, 0, 0
    deep, other = read_detections(message, to_map={"odom": shifted}.get)
    assert (deep.center, deep.box) == ((11, 2, 3), None)
    assert other.box == (1, 2, 3, 5)


def test_compressed_depth_by_hand():
    depth = np.array([[1.0, 2.5, 0.25], [np.inf, 4.0, 3.0]])
    found = read_depth_image(make_compressed_depth(0.0, depth))
    np.testing.assert_allclose(found, [[1.0, 2.5, 0.25], [0.0, 4.0, 3.0]])
    # 1000 / depth - 5 as whole numbers: 995, 395, 3995, none (-5 is read as 0), 245, 328
    found = read_depth_image(make_compressed_depth(0.0, depth, "32FC1", (1000.0, -5.0)))
    expected = [[1.0, 2.5, 0.25], [np.nan, 4.0, 1000 / 333]]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    message = make_compressed_depth(0.0, depth)
    for kind, data, error in (
        ("16UC1; compressedDepth rvl", b"\0" * 40, "must be 16UC1 or 32FC1 as PNG"),
        ("bgr8; jpeg compressed bgr8", message.data, "must be 16UC1 or 32FC1 as PNG"),
        ("16UC1; compressedDepth png", message.data[:40], "must be a PNG of 16 bits"),
        ("32FC1; compressedDepth png", message.data[12:], "must begin with 12 bytes"),
    ):
        with pytest.raises(ValueError, match=error):
            read_depth_image(Message(header=message.header, format=kind, data=data))


def test_boxes_in_any_frame_are_seen_from_the_camera():
    """Detections in the map say nothing of where the camera is: CameraInfo does."""
    mug = put_on(TABLE, 0.1, 0.3)
    builder = LookBuilder({7: TABLE})
    feed = CameraFeed(builder)
    feed.take_camera(make_camera_info(CAMERA))
    for number, pose in enumerate(look_around(TABLE.center)[:8]):
        time = 100 + 0.2 * number
        feed.take_detections(make_detections_3d(time, [("mug", 0.9, mug.center)], frame="map"))
        feed.take_depth(make_depth(time, render([TABLE, FLOOR, mug], pose)))
        turn = make_quaternion(pose.rotation)
        transform = make_transform(time, "map", "camera", pose.position, turn)
        feed.take_transforms(Message(transforms=[transform]))
    feed.finish()
    (look,) = builder.finish()
    assert [(one.description, one.relation) for one in look.seen] == [("mug", "onTop")]
    assert look.coverage["onTop"] > 0.5


def test_uncertainty_by_hand():
    covariance = np.zeros((6, 6))
    covariance[0, 0], covariance[1, 1], covariance[5, 5] = 0.04, 0.09, 0.01
    assert read_uncertainty(covariance.ravel()) == pytest.approx((0.3, 0.1))


def test_a_live_memory_remembers_and_says_where_to_look():
    home = HomeMap.from_values(MAP)
    memory = SceneGraphMemory()
    assert home.add_to(memory) == {0: Box(TABLE.center, TABLE.size, TABLE.yaw)}
    told = []
    live = LiveMemory(memory, Finder(Bayesian()), step_seconds=60, on_look=told.append)
    mug = put_on(TABLE, 0.1, 0.3)
    play(live.feed, look_around(TABLE.center)[:8], [("mug", mug)])
    live.finish()
    assert len(told) == 1
    assert live.rank("mug")[0].furniture == 0
    play(live.feed, look_around(TABLE.center)[:8], start=100 + 150)
    live.finish()
    assert memory.time == 2  # 150 s later
    assert memory.last_seen("mug").is_there is False
    look = live.find_next("mug", start=(0.0, 0.0))
    assert (look.furniture, look.name) == (0, "table 1 in kitchen")
    aim = np.array(TABLE.center[:2]) - look.position
    assert np.linalg.norm(aim) > 0.5
    np.testing.assert_allclose(look.yaw, np.arctan2(aim[1], aim[0]))
    (marker,) = live.list_markers("mug")
    assert marker.box == Box(TABLE.center, TABLE.size, TABLE.yaw)
    assert marker.text == f"table 1 in kitchen {marker.probability:.0%}"
    with pytest.raises(ValueError, match="memory must have furniture with boxes"):
        LiveMemory(SceneGraphMemory(), Finder(Bayesian()))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rooms": []}, "map must have rooms and furniture"),
        ({"robots": 1}, r"fields frame, rooms and furniture, got \['robots'\]"),
        ({"rooms": ["kitchen", "Kitchen"]}, "rooms must have names of their own"),
        ({"rooms": [{"label": "kitchen"}]}, "room 0 in home.yaml must have the fields name"),
        ({"furniture": [{"name": "table"}]}, "furniture 0 in home.yaml must have the fields"),
        ({"furniture": {"name": "table"}}, "furniture of a map must be a list"),
    ],
)
def test_maps_that_are_malformed(change, message):
    with pytest.raises(ValueError, match=message):
        HomeMap.from_values({**MAP, **change}, "home.yaml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"room": "attic"}, "room of furniture 0 in home.yaml must be one of .*got 'attic'"),
        ({"size": [1, 0, 1]}, "furniture 0 in home.yaml: size of a box must be at least"),
        ({"center": [1, 2]}, "furniture 0 in home.yaml: center of a box must be finite"),
        ({"is_open": True}, "is_open of furniture 0 in home.yaml must be true or false"),
        ({"colour": "red"}, r"got \['colour'\]"),
    ],
)
def test_furniture_of_maps_that_is_malformed(change, message):
    (table,) = MAP["furniture"]
    with pytest.raises(ValueError, match=message):
        HomeMap.from_values({**MAP, "furniture": [{**table, **change}]}, "home.yaml")


def test_polygons_of_a_map():
    around = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
    counter = {"name": "counter", "room": "kitchen", "polygon": around, "bottom": 0, "top": 0.9}
    rooms = [{"name": "kitchen", "floor": around}]
    home = HomeMap.from_values({"rooms": rooms, "furniture": [counter]})
    floor, top = (row.box for row in home.furniture)
    np.testing.assert_allclose(floor.corners, around, atol=1e-12)
    np.testing.assert_allclose(top.corners, around, atol=1e-12)
    assert (floor.top, top.top) == (pytest.approx(0.0), pytest.approx(0.9))
    for change, message in (
        ({"interior": "open"}, "furniture 0 in map: interior of a box with an outline must be"),
        ({"polygon": around[:2]}, "furniture 0 in map: polygon must have 3 to 64 corners"),
        ({"top": None}, "furniture 0 in map must have the fields name, room, polygon, bottom"),
        ({"size": [1, 1, 1]}, r"got \['size'\]"),
    ):
        with pytest.raises(ValueError, match=message):
            HomeMap.from_values({"rooms": ["kitchen"], "furniture": [{**counter, **change}]})
    with pytest.raises(ValueError, match="floor of room 1 in map: polygon must have an area"):
        HomeMap.from_values(
            {
                "rooms": ["kitchen", {"name": "hall", "floor": [[0, 0], [1, 1], [2, 2]]}],
                "furniture": [counter],
            }
        )


def test_labels_floors_and_doors_of_a_map():
    home = HomeMap.from_values(
        {
            "frame": "world",
            "rooms": ["kitchen", {"name": "bedroom 2", "floor": [[0, 0], [3, 4]]}],
            "furniture": [
                {
                    "name": "white fridge",
                    "label": "fridge",
                    "room": "kitchen",
                    "center": [1, 1, 0.9],
                    "size": [0.6, 0.6, 1.8],
                    "interior": "door",
                    "is_open": True,
                    "open_cost": 2,
                    "position": [2, 1],
                }
            ],
        }
    )
    assert (home.frame, home.rooms) == ("world", ("kitchen", "bedroom"))
    floor, fridge = home.furniture
    assert (floor.label, floor.room, floor.box) == ("floor", 1, Box.of_floor((0, 0), (3, 4)))
    assert (fridge.label, fridge.open_cost, fridge.is_open) == ("fridge", 2.0, True)
    memory = SceneGraphMemory()
    home.add_to(memory)
    assert memory.get_position(1) == (2.0, 1.0)
    assert memory.layout.furniture[1].box == fridge.box

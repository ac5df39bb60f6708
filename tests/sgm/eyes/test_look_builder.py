import numpy as np
import pytest

from sgm.camera.camera_view import CameraView
from sgm.camera.depth_image import DepthImage
from sgm.camera.scene import Scene
from sgm.eyes import Box, Gate, Intrinsics, LookBuilder, LookRules, Pose
from sgm.eyes.look_builder import MOST_DETECTIONS
from sgm.layout.outline import contains_points, read_outline
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from tests.sgm.eyes.scenes import (
    CAMERA,
    FLOOR,
    TABLE,
    compute_true_share,
    detect,
    look_around,
    make_shelf,
    put_on,
    render,
)


def walk(builder, poses, solid, things=(), start=0.0, step=0.2, **more):
    """Take frames along a path, all things detected in each, and return the looks."""
    bodies = [body for _, body in things]
    for number, pose in enumerate(poses):
        found = [detect(name, body, pose) for name, body in things]
        depth = render([*solid, *bodies], pose)
        builder.frame(start + step * number, pose, CAMERA, found, depth, **more)
    return {look.furniture: look for look in builder.finish()}


def test_thirty_frames_of_a_table_are_one_look():
    mug, plate = put_on(TABLE, 0.1, 0.3), put_on(TABLE, -0.2, -0.2, (0.2, 0.2, 0.02))
    builder = LookBuilder({7: TABLE, 8: FLOOR})
    poses = look_around(TABLE.center)
    looks = walk(builder, poses, [TABLE, FLOOR], [("mug", mug), ("plate", plate)])
    look = looks[7]
    assert look.num_frames == 30
    assert sorted((one.description, one.relation) for one in look.seen) == [
        ("mug", "onTop"),
        ("plate", "onTop"),
    ]
    assert min(one.confidence for one in look.seen) > 0.95
    true = compute_true_share(TABLE, "onTop", [TABLE, FLOOR, mug, plate], poses)
    assert look.coverage["onTop"] == pytest.approx(true, abs=0.05)
    assert look.coverage["in"] == look.coverage["onTop"]  # there is no inside
    assert looks[8].seen == ()
    true = compute_true_share(FLOOR, "onTop", [TABLE, FLOOR], poses, others=[TABLE])
    assert looks[8].coverage["onTop"] == pytest.approx(true, abs=0.05)
    assert builder.counts["looks"] == 2
    assert "detections at no place" not in builder.counts


def test_open_shelves_from_the_front_and_from_behind():
    shelf, parts = make_shelf((2, 0, 0.9), (0.4, 0.8, 1.8), yaw=np.pi)  # its front looks to -x
    book = Box((1.9, 0.2, 1.0), (0.1, 0.05, 0.16))
    poses = look_around((2, 0, 1.0), turn=0.6)
    look = walk(LookBuilder({3: shelf}), poses, parts, [("book", book)])[3]
    true = compute_true_share(shelf, "in", [*parts, book], poses)
    assert look.coverage["in"] == pytest.approx(true, abs=0.05)
    assert true > 0.5
    assert [(one.description, one.relation) for one in look.seen] == [("book", "in")]
    behind = look_around((2, 0, 1.0), turn=0.6, start=0.0)
    look = walk(LookBuilder({3: shelf}), behind, parts).get(3)
    assert look is None or look.coverage["in"] == 0


def test_a_shut_door_was_not_looked_into_and_an_open_one_was():
    fridge, parts = make_shelf((2, 0, 0.9), (0.6, 0.6, 1.8), yaw=np.pi)
    fridge = Box(fridge.center, fridge.size, fridge.yaw, "door")
    milk = put_on(Box((2, 0, 0.45), (0.2, 0.2, 0.9)), 0, 0)  # on the middle board, nearly
    poses = look_around((2, 0, 1.2), height=1.5, turn=0.6)
    builder = LookBuilder({3: fridge})
    magnet = [detect("magnet", Box((1.69, 0, 1.3), (0.01, 0.05, 0.05)), pose) for pose in poses]
    for number, pose in enumerate(poses):
        builder.frame(0.2 * number, pose, CAMERA, [magnet[number]], render([fridge], pose))
    looks = list(builder.finish())
    assert all(look.coverage["in"] == 0 and not look.seen for look in looks)
    assert builder.counts["detections at no place"] == 30
    assert len(builder.unassigned) == 30
    builder.set_open(3)
    look = walk(builder, poses, parts, [("milk", milk)], start=100.0)[3]
    true = compute_true_share(fridge, "in", [*parts, milk], poses)
    assert look.coverage["in"] == pytest.approx(true, abs=0.05)
    assert [(one.description, one.relation) for one in look.seen] == [("milk", "in")]
    builder.set_open(3, False)
    assert all(
        look.coverage["in"] == 0 for look in walk(builder, poses, [fridge], start=200.0).values()
    )


def test_what_stands_before_a_place_hides_it():
    wall = Box((1.0, -0.35, 0.8), (0.1, 0.5, 1.6))
    poses = look_around(TABLE.center, turn=0.1)
    look = walk(LookBuilder({7: TABLE}), poses, [TABLE, wall])[7]
    true = compute_true_share(TABLE, "onTop", [TABLE, wall], poses)
    assert 0.2 < true < 0.8
    assert look.coverage["onTop"] == pytest.approx(true, abs=0.05)


def test_without_depth_the_other_boxes_hide_and_coverage_is_capped():
    wall = Box((1.0, -0.35, 0.8), (0.1, 0.5, 1.6))
    poses = look_around(TABLE.center, turn=0.1)
    builder = LookBuilder({7: TABLE, 9: wall, 8: FLOOR})
    mug = put_on(TABLE, 0.1, 0.35)
    for number, pose in enumerate(poses):
        builder.frame(0.2 * number, pose, CAMERA, [detect("mug", mug, pose)])
    looks = {look.furniture: look for look in builder.finish()}
    true = compute_true_share(TABLE, "onTop", [TABLE, wall], poses)
    assert looks[7].coverage["onTop"] == pytest.approx(min(true, 0.7), abs=0.05)
    assert [(one.description, one.relation) for one in looks[7].seen] == [("mug", "onTop")]
    alone = LookBuilder({7: TABLE}, rules=LookRules(most_blind=0.6))
    for number, pose in enumerate(look_around(TABLE.center)):
        alone.frame(0.2 * number, pose, CAMERA)
    assert next(alone.finish()).coverage == {"in": 0.6, "onTop": 0.6}


def test_holes_in_the_depth_are_unknown():
    poses = look_around(TABLE.center)[:3]
    builder = LookBuilder({7: TABLE})
    for number, pose in enumerate(poses):
        depth = render([TABLE], pose)
        depth[:, :] = (np.nan, 0.0, -np.inf)[number]
        builder.frame(0.2 * number, pose, CAMERA, [detect("mug", put_on(TABLE, 0, 0), pose)], depth)
    assert list(builder.finish()) == []
    assert builder.counts == {
        "frames": 3,
        "detections": 3,
        "detections of low score": 0,
        "detections without depth": 3,
    }


def test_points_beside_an_edge_by_hand():
    """Pixels (0, 0), (1, 0), (0, 1), (1, 1) measured 1, 3, nothing and infinity.

    A point 2 m ahead, .3 of a pixel right of the first one and on its row, is shown by the second
    one alone: .3 of the weights. One in the middle of all four has three that measured, of which
    two show it. What is farther than 3 m is shown by the last one alone.
    """
    camera = Intrinsics(100.0, 100.0, 0.5, 0.5, 2, 2)
    depth = np.array([[1.0, 3.0], [np.nan, np.inf]])
    pose = Pose(np.eye(3), np.zeros(3))
    view = CameraView(Scene({}), pose, camera, DepthImage(depth, camera), (0.2, 9.0))
    pixels = np.array([[0.3, 0.0], [0.5, 0.5], [0.5, 0.5], [0.0, 1.0], [0.0, 0.0]])
    away = np.array([2.0, 2.0, 4.0, 2.0, 1.0])
    share = view.compute_seen(camera.unproject(pixels, away), 0.0, np.zeros(5, dtype=int))
    np.testing.assert_allclose(share, [0.3, 2 / 3, 1 / 3, 0.0, 1.0], atol=1e-9)


def test_noise_over_many_frames_shows_no_more_than_there_is():
    """A screen hides one half of the volume; depth errs by 1 cm in each frame."""
    screen = Box((1.5, -0.4, 0.8), (0.02, 0.8, 1.6))
    pose, rng = look_around(TABLE.center)[15], np.random.default_rng(0)
    depth = render([TABLE, screen], pose)
    builder = LookBuilder({7: TABLE})
    for number in range(40):
        builder.frame(0.2 * number, pose, CAMERA, (), depth + rng.normal(0, 0.01, depth.shape))
    true = compute_true_share(TABLE, "onTop", [TABLE, screen], [pose])
    assert 0.3 < true < 0.8
    assert next(builder.finish()).coverage["onTop"] == pytest.approx(true, abs=0.02)


def test_millimetres_are_whole_numbers():
    poses = look_around(TABLE.center, num=3)
    metres, millimetres = LookBuilder({7: TABLE}), LookBuilder({7: TABLE})
    for number, pose in enumerate(poses):
        depth = np.minimum(render([TABLE], pose), 60.0)
        metres.frame(0.2 * number, pose, CAMERA, (), depth)
        millimetres.frame(0.2 * number, pose, CAMERA, (), np.rint(depth * 1000).astype(np.uint16))
    one, other = next(metres.finish()), next(millimetres.finish())
    assert one.coverage["onTop"] == pytest.approx(other.coverage["onTop"], abs=0.01)
    with pytest.raises(ValueError, match=r"depth must be at most 200 m, got 60000\. Give metres"):
        metres.frame(100.0, poses[0], CAMERA, (), np.full((120, 160), 60000.0))


def test_two_of_a_kind_and_a_detector_with_numbers():
    things = [("mug", put_on(TABLE, 0.1, 0.3)), ("mug", put_on(TABLE, 0.1, -0.3))]
    look = walk(LookBuilder({7: TABLE}), look_around(TABLE.center), [TABLE], things)[7]
    assert [one.description for one in look.seen] == ["mug", "mug"]
    builder = LookBuilder({7: TABLE})
    mug = things[0][1]
    for number, pose in enumerate(look_around(TABLE.center)):
        name = "cup" if number % 3 == 0 else "mug"  # one thing by its number, called two names
        seen = [detect(name, mug, pose, track=4)]
        builder.frame(0.2 * number, pose, CAMERA, seen, render([TABLE, mug], pose))
    assert [one.description for one in next(builder.finish()).seen] == ["mug"]


def test_of_two_names_at_one_spot_the_more_frequent_is_kept():
    mug = put_on(TABLE, 0.1, 0.3)
    builder = LookBuilder({7: TABLE})
    for number, pose in enumerate(look_around(TABLE.center)):
        seen = [detect("cup" if number % 3 == 0 else "mug", mug, pose)]
        builder.frame(0.2 * number, pose, CAMERA, seen, render([TABLE, mug], pose))
    assert [one.description for one in next(builder.finish()).seen] == ["mug"]


def test_votes_become_one_confidence():
    mug, poses = put_on(TABLE, 0.1, 0.3), look_around(TABLE.center)
    confidence = {}
    for seen_every in (1, 2, 15):
        builder = LookBuilder({7: TABLE}, rules=LookRules(least_confidence=0.0))
        for number, pose in enumerate(poses):
            seen = [detect("mug", mug, pose)] * (number % seen_every == 0)
            builder.frame(0.2 * number, pose, CAMERA, seen, render([TABLE, mug], pose))
        (one,) = next(builder.finish()).seen
        confidence[seen_every] = one.confidence
    # 2 of 30: logit .9 = 2.20; votes (2 * 1.79 - 28 * .81) * 5 / 30 = -3.19; less 1.79
    assert confidence[15] == pytest.approx(1 / (1 + np.exp(2.79)), abs=0.005)
    assert confidence[1] > confidence[2] > 0.9
    builder = LookBuilder({7: TABLE})
    builder.frame(
        0.0, poses[0], CAMERA, [detect("mug", mug, poses[0])], render([TABLE, mug], poses[0])
    )
    assert next(builder.finish()).seen[0].confidence == pytest.approx(0.9)  # one frame: the score


def test_only_what_a_ray_went_through_is_absent():
    mug, vase = put_on(TABLE, 0.1, 0.0), put_on(TABLE, 0.1, 0.4)
    screen = Box((1.75, 0.0, 0.9), (0.02, 0.4, 0.4))  # before the mug
    poses = look_around(TABLE.center, turn=0.2)
    builder = LookBuilder({7: TABLE})
    things = [("mug", mug), ("vase", vase)]
    assert walk(builder, poses, [TABLE], things)[7].hidden == ()
    # The screen is there and the vase is gone; the mug is hidden, whether it is there or not.
    for start, bodies in ((100.0, [TABLE, screen, mug]), (200.0, [TABLE, screen])):
        look = walk(builder, poses, bodies, start=start)[7]
        assert (look.seen, look.hidden) == ((), ("mug",))
    assert walk(builder, poses, [TABLE], start=400.0)[7].hidden == ()  # both are gone, in view


def test_what_the_detector_missed_is_hidden_not_absent():
    mug = put_on(TABLE, 0.1, 0.0)
    poses = look_around(TABLE.center, turn=0.2)
    builder = LookBuilder({7: TABLE})
    walk(builder, poses, [TABLE], [("mug", mug)])
    look = walk(builder, poses, [TABLE, mug], start=100.0)[7]  # its body is there, undetected
    assert look.hidden == ("mug",)


@pytest.mark.parametrize(
    ("offset", "hidden"),
    [((0, 0, 0), ()), ((0, 0.1, 0), ("mug",)), ((0, 0, 0.1), ("mug",))],
    ids=["at the spot", "beside it", "above it"],
)
def test_what_stands_at_the_very_spot_shows_that_a_thing_has_left(offset, hidden):
    """A can of the size of the mug: 7 cm wide, 10 cm high."""
    mug, poses = put_on(TABLE, 0.1, 0.0), look_around(TABLE.center, turn=0.2)
    builder = LookBuilder({7: TABLE})
    walk(builder, poses, [TABLE], [("mug", mug)])
    can = Box(tuple(np.add(mug.center, offset)), mug.size)
    look = walk(builder, poses, [TABLE, mug], [("can", can)], start=100.0)[7]
    assert [one.description for one in look.seen] == ["can"]
    assert look.hidden == hidden


def test_a_thing_of_middle_height_can_be_absent_with_an_uncertain_pose():
    """A can of 5 cm, seen from 1.6 m away and .7 m above: the table is 10 cm behind its upper part.

    That is nearer than half of its 7 cm along the ray, 3 cm and 2 x 2 cm of the pose together. The
    threshold is the middle between its front and the table.
    """
    mug, poses = put_on(TABLE, 0.1, 0.0, (0.08, 0.08, 0.05)), look_around(TABLE.center, turn=0.2)
    poses = [Pose(pose.rotation, pose.position, position_sd=0.02) for pose in poses]
    builder = LookBuilder({7: TABLE})
    walk(builder, poses, [TABLE], [("mug", mug)])
    assert walk(builder, poses, [TABLE, mug], start=100.0)[7].hidden == ("mug",)
    assert walk(builder, poses, [TABLE], start=200.0)[7].hidden == ()


def test_a_visit_ends_with_a_pause_and_is_cut_when_it_is_long():
    pose = look_around(TABLE.center)[0]
    depth = render([TABLE], pose)
    away = Pose(-pose.rotation @ np.diag([1, -1, 1]), pose.position)  # turned round
    builder = LookBuilder(
        {7: TABLE}, rules=LookRules(pause=2.0, longest=10.0), gate=Gate(most_turn=1e9)
    )
    for number in range(60):
        builder.frame(0.5 * number, pose, CAMERA, (), depth)
    assert [(look.start, look.end) for look in builder.looks()] == [(0.0, 10.0), (10.5, 20.5)]
    for number in range(60, 65):
        builder.frame(0.5 * number, away, CAMERA, (), np.full_like(depth, np.inf))
    assert [(look.start, look.end) for look in builder.looks()] == [(21.0, 29.5)]
    assert list(builder.finish()) == []


_ARMS = [Box((2.0, -0.7, 0.45), (2.0, 0.6, 0.9)), Box((1.3, 0.0, 0.45), (0.6, 2.0, 0.9))]
_ROUND_THE_CORNER = [(1, -1), (3, -1), (3, -0.4), (1.6, -0.4), (1.6, 1), (1, 1)]


@pytest.mark.parametrize("has_depth", [True, False])
def test_a_counter_round_the_corner_is_one_place(has_depth):
    """Both arms are in view, and a mug in the notch between them is on the floor."""
    counter = Box.of_polygon(_ROUND_THE_CORNER, 0.0, 0.9)
    mug, ball = put_on(_ARMS[1], 0.0, 0.5), put_on(FLOOR, 1.3, 0.2)
    poses = look_around((1.8, 0.0, 0.7), radius=2.2, turn=1.0, start=0.9)
    builder = LookBuilder({7: counter, 8: FLOOR}, rules=LookRules(most_blind=1.0))
    solid, things = [*_ARMS, FLOOR], [("mug", mug), ("ball", ball)]
    for number, pose in enumerate(poses):
        found = [detect(name, body, pose) for name, body in things]
        depth = render([*solid, mug, ball], pose) if has_depth else None
        builder.frame(0.2 * number, pose, CAMERA, found, depth)
    looks = {look.furniture: look for look in builder.finish()}
    assert [one.description for one in looks[7].seen] == ["mug"]
    assert [one.description for one in looks[8].seen] == ["ball"]
    own = np.array([contains(_ROUND_THE_CORNER, point) for point in ((1.3, 0.5), (2.2, 0.2))])
    assert own.tolist() == [True, False]
    hidden = [mug, ball] if has_depth else []
    true = compute_true_share(FLOOR, "onTop", [*solid, *hidden], poses, others=_ARMS)
    assert looks[8].coverage["onTop"] == pytest.approx(true, abs=0.03)


def contains(corners, point):
    return bool(contains_points(read_outline("polygon", corners), np.array(point, dtype=float)))


def test_a_look_says_from_where_most_was_in_view(tmp_path):
    """The camera turns to the table from the side, so that the middle frame shows all of it.

    Columns reach from -.5 to 159.5 around 79.5: 80 pixels to both sides at a focal length of 140.
    """
    at = np.array([0.0, 0.0, 1.4])
    turns = np.linspace(-0.8, 0.8, 17)
    ways = [np.array([np.cos(turn), np.sin(turn), -0.4]) for turn in turns]
    poses = [Pose.look_at(at, at + way) for way in ways]
    looks = walk(LookBuilder({7: TABLE}), poses, [TABLE])
    seen = looks[7].viewpoint
    assert (seen.x, seen.y, seen.z) == (0.0, 0.0, 1.4)
    assert abs(seen.yaw) < 0.25
    assert seen.angle == pytest.approx(2 * np.arctan(80 / 140))
    assert seen.reach == Gate().farthest
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    while memory.num_furniture < 8:
        memory.add_furniture("table", room)
    looks[7].tell(memory)
    (line,) = [one for one in read_events(tmp_path / "looks.sgm") if one.kind == "look"]
    assert line.values["viewpoint"].yaw == pytest.approx(seen.yaw, abs=1e-3)


def test_from_straight_above_ahead_is_what_is_up_in_the_image():
    """The image's x is the map's x, its y the map's -y."""
    down = Pose(np.diag([1.0, -1.0, -1.0]), np.array([1.0, 2.0, 3.0]))
    view = CameraView(Scene({}), down, Intrinsics(10.0, 10.0, 5.0, 5.0, 11, 11), None, (0.2, 9.0))
    found = view.make_viewpoint()
    assert found.yaw == pytest.approx(np.pi / 2)
    assert found.angle == pytest.approx(2 * np.arctan(0.55))


def test_looks_are_handed_to_a_callback():
    looks = []
    builder = LookBuilder({7: TABLE}, on_look=looks.append)
    assert walk(builder, look_around(TABLE.center, num=3), [TABLE]) == {}
    assert [look.furniture for look in looks] == [7]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"pose": None}, "no transform"),
        ({"pose_time": 9.0}, "transform too old"),
        ({"pose_time": np.nan}, "transform too old"),
        ({"pose_time": -(10**400)}, "transform too old"),
        ({"time": 9.9}, "time went back"),
        ({"time": 10.0}, "frame came twice"),
        ({"time": np.nan}, "time is no number"),
        ({"time": 10**400}, "time is no number"),
        ({"time": np.inf}, "time is no number"),
        ({"time": "now"}, "time is no number"),
        ({"time": 10.01}, "camera too fast"),
        ({"pose": Pose.look_at((0, 0, 1.4), (2, 0, 0.4), position_sd=0.5)}, "pose uncertain"),
        ({"pose": Pose.look_at((0, 0, 1.4), (2, 0, 0.4), angle_sd=0.5)}, "pose uncertain"),
        ({"pose": Pose.look_at((0.4, 0, 1.4), (-2, 0, 1))}, "camera too fast"),
    ],
)
def test_what_is_left_out_is_counted(change, reason):
    builder = LookBuilder({7: TABLE})
    pose, then = look_around(TABLE.center, num=40)[:2]
    depth = render([TABLE], pose)
    assert builder.frame(10.0, pose, CAMERA, (), depth)
    frame = {"time": 10.2, "pose": then, "intrinsics": CAMERA, "depth": depth}
    assert not builder.frame(**{**frame, **change})
    assert builder.counts[reason] == 1
    assert next(builder.finish()).num_frames == 1


def test_the_clock_may_be_set_back_after_an_end():
    builder = LookBuilder({7: TABLE})
    pose = look_around(TABLE.center)[0]
    depth = render([TABLE], pose)
    assert builder.frame(1e9, pose, CAMERA, (), depth)
    assert len(list(builder.finish())) == 1
    assert builder.frame(1.0, pose, CAMERA, (), depth)


def test_detections_out_of_range_and_of_low_score_are_counted():
    builder = LookBuilder({7: TABLE}, gate=Gate(farthest=1.0, least_score=0.5))
    pose, mug = look_around(TABLE.center)[0], put_on(TABLE, 0, 0)
    seen = [detect("mug", mug, pose), detect("mug", mug, pose, score=0.4)]
    builder.frame(0.0, pose, CAMERA, seen, render([TABLE, mug], pose))
    assert builder.counts["detections out of range"] == 1
    assert builder.counts["detections of low score"] == 1
    assert list(builder.finish()) == []


def test_furniture_may_change():
    builder = LookBuilder({7: TABLE})
    poses, mug = look_around(TABLE.center, turn=0.2), put_on(TABLE, 0.1, 0.0)
    walk(builder, poses, [TABLE], [("mug", mug)])
    door = Box((5, 5, 1), (1, 1, 2), 0.0, "door")
    builder.set_furniture({2: door, 7: TABLE})
    builder.set_open(2)
    builder.set_furniture({2: door, 7: TABLE})
    assert builder._scene.is_open.tolist() == [True, True]
    screen = Box((1.75, 0.0, 0.9), (0.02, 0.4, 0.4))
    assert walk(builder, poses, [TABLE, screen], start=100.0)[7].hidden == ("mug",)


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda b, at: b.frame(0.0, "here", CAMERA), TypeError, "pose must be of Pose"),
        (lambda b, at: b.frame(0.0, at, None), TypeError, "intrinsics must be of"),
        (lambda b, at: b.frame(0.0, at, CAMERA, 3), TypeError, "detections must hold Detection ob"),
        (lambda b, at: b.frame(0.0, at, CAMERA, ["mug"]), TypeError, "detections"),
        (
            lambda b, at: b.frame(0.0, at, CAMERA, (), np.ones((2, 2))),
            ValueError,
            r"depth must be numbers of shape \(120, 160\), as the intrinsics say, got float64",
        ),
        (lambda b, at: b.frame(0.0, at, CAMERA, (), "depth"), ValueError, "depth"),
        (lambda b, at: b.set_open(1), KeyError, "furniture must be the id of one with"),
        (lambda b, at: b.set_open(7), ValueError, "furniture must have a door"),
        (lambda b, at: b.set_furniture({1: "box"}), TypeError, "box must be a Box"),
        (lambda b, at: b.set_furniture([]), TypeError, "furniture must be a mapping"),
        (lambda b, at: LookRules(margin=-1), ValueError, "margin must be at least 0"),
        (lambda b, at: LookRules(most_blind=2), ValueError, "most_blind must lie in"),
        (lambda b, at: Gate(farthest=0.1), ValueError, "farthest must be beyond nearest"),
        (lambda b, at: Gate(most_speed=-1), ValueError, "most_speed must be at least 0"),
    ],
)
def test_bad_calls_are_one_line(call, kind, message):
    builder = LookBuilder({7: TABLE})
    with pytest.raises(kind, match=message) as error:
        call(builder, look_around(TABLE.center)[0])
    assert "\n" not in str(error.value)


def test_as_many_detections_as_a_frame_may_have():
    builder = LookBuilder({7: TABLE})
    pose, mug = look_around(TABLE.center)[0], put_on(TABLE, 0.0, 0.0)
    seen = [detect("mug", mug, pose)] * (MOST_DETECTIONS + 1)
    depth = render([TABLE, mug], pose)
    with pytest.raises(ValueError, match=r"detections must be at most 1000 in a frame, got 1001"):
        builder.frame(0.0, pose, CAMERA, seen, depth)
    for number in range(2):
        assert builder.frame(number * 0.1, pose, CAMERA, seen[1:], depth)
    (look,) = builder.finish()
    assert len(look.seen) == MOST_DETECTIONS  # each of two frames: the second ones are the same


def test_no_furniture_at_all():
    builder = LookBuilder({})
    pose = look_around(TABLE.center)[0]
    seen = [detect("mug", put_on(TABLE, 0, 0), pose)]
    assert builder.frame(0.0, pose, CAMERA, seen, render([TABLE], pose))
    assert builder.frame(0.1, pose, CAMERA, seen)
    assert list(builder.finish()) == []
    assert builder.counts["detections at no place"] == 2
    assert [one.center is None for one in builder.unassigned] == [False, True]


def test_a_thing_that_lies_along_the_ray_is_where_its_middle_is():
    """A rod of 30 cm on the lowest board reaches, as it seems from above, 6 cm below the board.

    The camera is 1.2 m above it and 1 m away. Its box in pixels is as high as that of a thing that
    stands upright, so its lower side is taken to be below the floor of the shelf.
    """
    shelf, parts = make_shelf((1.4, 0, 0.5), (0.5, 0.8, 1.0), yaw=np.pi)
    rod = Box((1.35, 0.0, 0.05), (0.3, 0.06, 0.06))
    pose = Pose.look_at((0.2, 0.0, 1.0), (1.35, 0.0, 0.05))
    assigned = []
    builder = LookBuilder({3: shelf}, on_detection=lambda *row: assigned.append(row))
    detection = detect("rod", rod, pose)
    builder.frame(0.0, pose, CAMERA, [detection], render([*parts, rod], pose))
    assert assigned == [(detection, 3, "in")]


def test_every_detection_that_counts_is_handed_on():
    mug, lost = put_on(TABLE, 0.1, 0.3), Box((1.0, 3.0, 1.5), (0.1, 0.1, 0.1))
    assigned = []
    builder = LookBuilder({7: TABLE}, on_detection=lambda *row: assigned.append(row[1:]))
    poses = look_around(TABLE.center)[:3]
    looks = walk(builder, poses, [TABLE, FLOOR], [("mug", mug)])
    assert assigned == [(7, "onTop")] * 3
    assert looks[7].num_frames == 3
    pose = Pose.look_at((0, 0, 1), lost.center)
    builder.frame(9.0, pose, CAMERA, [detect("lamp", lost, pose)], render([FLOOR, lost], pose))
    assert assigned[3:] == [(None, None)]


def test_a_thing_that_was_measured_too_low_can_be_absent():
    """Its spot is on the table, not in it, so that a ray can go through."""
    mug, poses = put_on(TABLE, 0.1, 0.0, (0.06, 0.06, 0.05)), look_around(TABLE.center, turn=0.2)
    builder = LookBuilder({7: TABLE})
    low = [Pose(pose.rotation, pose.position - (0, 0, 0.03), position_sd=0.02) for pose in poses]
    for number, (pose, wrong) in enumerate(zip(poses, low, strict=True)):
        found = [detect("mug", mug, pose)]
        builder.frame(0.2 * number, wrong, CAMERA, found, render([TABLE, mug], pose))
    assert next(builder.finish()).seen[0].description == "mug"
    assert walk(builder, poses, [TABLE], start=100.0)[7].hidden == ()


@pytest.mark.parametrize(("size", "hidden"), [(0.012, ("mug",)), (0.04, ())])
def test_rays_beside_a_corner_do_not_tell_that_a_thing_has_left(size, hidden):
    corner, poses = put_on(TABLE, 0.1, 0.0, (size, size, size)), look_around(TABLE.center, turn=0.2)
    builder = LookBuilder({7: TABLE})
    walk(builder, poses, [TABLE], [("mug", corner)])
    assert walk(builder, poses, [TABLE], start=100.0)[7].hidden == hidden


def test_what_is_not_sure_is_not_seen():
    mug, pose = put_on(TABLE, 0.1, 0.3), look_around(TABLE.center)[0]
    builder = LookBuilder({7: TABLE})
    seen = [detect("mug", mug, pose, score=0.4)]
    builder.frame(0.0, pose, CAMERA, seen, render([TABLE, mug], pose))
    assert next(builder.finish()).seen == ()

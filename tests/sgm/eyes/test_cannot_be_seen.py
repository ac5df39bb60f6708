"""What a camera cannot have seen is not seen; a depth image that contradicts the map is none."""

import numpy as np
import pytest

from sgm import SceneGraphMemory
from sgm.eyes import Box, Detection, FurnitureMapper, LookBuilder, Pose
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, detect, look_around, put_on, render

MUG = put_on(TABLE, 0.1, 0.3)
POSES = look_around(TABLE.center)[:8]
WALL = Box((1.0, 0.0, 1.0), (0.1, 4.0, 2.0))
SHELF = Box((2.0, 0.0, 0.9), (0.4, 0.8, 1.8), np.pi, "open")
AWAY = [Pose.look_at(pose.position, 2 * pose.position - TABLE.center) for pose in POSES]
ENDLESS = np.full((CAMERA.height, CAMERA.width), np.inf)
GHOST = "detections that depth goes through"


def publish(poses, solid, center=MUG.center, size=None, *, has_depth=True, name="mug"):
    """Frames of a detector that names the center of a mug, whatever the camera shows."""
    builder = LookBuilder({7: TABLE, 8: FLOOR})
    for number, pose in enumerate(poses):
        depth = render(solid, pose) if has_depth else None
        found = [Detection(name, 0.9, center=center, size=size)]
        builder.frame(0.2 * number, pose, CAMERA, found, depth)
    looks = list(builder.finish())
    return [thing.description for look in looks for thing in look.seen], builder.counts


@pytest.mark.parametrize("size", [None, MUG.size])
@pytest.mark.parametrize(
    ("poses", "solid", "reason"),
    [
        (AWAY, [TABLE, FLOOR, MUG], "detections outside the image"),
        (POSES, [TABLE, FLOOR], GHOST),
        (POSES, [FLOOR], GHOST),  # the table is gone, too
        (POSES, [TABLE, FLOOR, MUG, WALL], "detections behind what was measured"),
    ],
)
def test_a_center_that_the_camera_cannot_see_is_left_out_and_counted(poses, solid, reason, size):
    seen, counts = publish(poses, solid, size=size)
    assert seen == []
    assert counts[reason] == len(poses)


@pytest.mark.parametrize("size", [(0.07, 0.07, 0.1), (0.03, 0.03, 0.2), (0.3, 0.2, 0.25)])
@pytest.mark.parametrize("x", [-0.3, 0.0, 0.3])
def test_a_center_that_it_can_see_counts_and_one_of_a_thing_that_has_left_does_not(size, x):
    thing = put_on(TABLE, x, -x, size)
    error = np.array([0.01, -0.01, 0.01])  # of the detector
    for given in (size, None):
        seen, counts = publish(POSES, [TABLE, FLOOR, thing], thing.center + error, given)
        assert seen == ["mug"], counts
        seen, counts = publish(POSES, [TABLE, FLOOR], thing.center + error, given)
        assert seen == [], counts
        assert counts[GHOST] == len(POSES)


def test_flat_things_are_believed_on_what_bears_them_and_nowhere_else():
    plate = put_on(TABLE, 0.1, 0.1, (0.2, 0.2, 0.02))
    assert publish(POSES, [TABLE, FLOOR, plate], plate.center, plate.size)[0] == ["mug"]
    in_the_air = (*plate.center[:2], 1.2)
    assert publish(POSES, [TABLE, FLOOR], in_the_air, plate.size)[0] == []


def play_plate(size, noise, *, is_there, jitter=0.0, solid=(), at=(0.1, 0.1), num=10):
    """Frames of a detector that names center and size of a flat thing, with noise in the depth."""
    plate = put_on(TABLE, *at, size)
    rng = np.random.default_rng(0)
    builder = LookBuilder({7: TABLE, 8: FLOOR})
    for number, pose in enumerate(look_around(TABLE.center, num=num, turn=0.5)):
        depth = render([TABLE, FLOOR, *solid, *[plate] * is_there], pose)
        depth = depth + noise * rng.normal(size=depth.shape)
        center = plate.center + jitter * rng.normal(size=3)
        found = [Detection("plate", 0.9, center=center, size=size)]
        builder.frame(0.2 * number, pose, CAMERA, found, depth)
    seen = [thing.description for look in builder.list_open() for thing in look.seen]
    looks = list(builder.finish())
    assert seen == [thing.description for look in looks for thing in look.seen]
    return seen, builder.counts


FLAT = [(0.2, 0.2, 0.02), (0.2, 0.2, 0.04), (0.3, 0.22, 0.03), (0.16, 0.16, 0.02)]


@pytest.mark.parametrize("noise", [0.0, 0.005, 0.01])
@pytest.mark.parametrize("size", FLAT)
def test_a_flat_thing_that_is_gone_is_left_out_by_the_frames_of_a_look_together(size, noise):
    assert play_plate(size, noise, is_there=True)[0] == ["plate"]
    seen, counts = play_plate(size, noise, is_there=False)
    assert seen == []
    assert counts[GHOST] == 10


@pytest.mark.parametrize("at", [(0.29, 0.45), (-0.25, -0.3), (0.0, 0.4)])
def test_an_edge_of_a_table_or_a_thing_beside_a_flat_one_is_no_relief(at):
    size = (0.2, 0.2, 0.02)
    beside = [put_on(TABLE, at[0] - 0.17, at[1] - 0.1), put_on(TABLE, at[0], at[1] - 0.2)]
    for solid in ([], beside):
        assert play_plate(size, 0.005, is_there=True, solid=solid, at=at)[0] == ["plate"]
        assert play_plate(size, 0.005, is_there=False, solid=solid, at=at)[0] == []


def test_what_frames_measure_anew_is_believed_however_flat_it_is():
    """A newspaper: the detector sees it, and guesses how thick it is."""
    assert play_plate((0.3, 0.2, 0.02), 0.01, is_there=False, jitter=0.005)[0] == ["plate"]


def test_a_flat_thing_behind_another_one_or_without_depth_is_not_called_gone():
    wall = [put_on(TABLE, -0.3, 0.1, (0.02, 0.5, 0.3))]
    _, counts = play_plate((0.2, 0.2, 0.02), 0.0, is_there=True, solid=wall)
    assert GHOST not in counts
    _, counts = play_plate((0.2, 0.2, 0.02), np.nan, is_there=False)
    assert GHOST not in counts


def test_without_depth_the_image_alone_decides():
    assert publish(POSES, [], has_depth=False)[0] == ["mug"]
    seen, counts = publish(AWAY, [], has_depth=False)
    assert seen == []
    assert counts["detections outside the image"] == len(AWAY)


def test_furniture_out_of_the_image_is_not_drawn():
    memory = SceneGraphMemory()
    builder = LookBuilder(discover=FurnitureMapper(memory))
    table = Detection("table", 0.9, center=TABLE.center, size=TABLE.size)
    for number, pose in enumerate(AWAY):
        builder.frame(0.2 * number, pose, CAMERA, [table], render([FLOOR], pose))
    list(builder.finish())
    assert builder.counts["detections outside the image"] == len(AWAY)
    assert not memory.layout.furniture


def test_an_endless_depth_image_is_no_empty_table():
    memory = SceneGraphMemory()
    memory.add_furniture("table", memory.add_room("kitchen"), box=TABLE)
    builder = LookBuilder(memory.layout.furniture)
    for number, pose in enumerate(POSES):
        found = [detect("mug", MUG, pose)]
        builder.frame(0.2 * number, pose, CAMERA, found, render([TABLE, FLOOR, MUG], pose))
    for look in builder.finish():
        look.tell(memory)
    known = memory.last_seen("mug")
    for start in (100, 200, 300, 400):
        for number, pose in enumerate(POSES):
            assert not builder.frame(start + 0.2 * number, pose, CAMERA, (), ENDLESS)
        assert list(builder.finish()) == []
    assert builder.counts["depth through furniture"] == 4 * len(POSES)
    assert known.is_there
    assert memory.last_seen("mug") == known


@pytest.mark.parametrize(
    "furniture",
    [SHELF, FLOOR, Box((2, 0, 0.5), (0.6, 0.6, 1.0), 0, "door"), Box((2, 0, 0.3), (2, 2, 0.6))],
)
@pytest.mark.parametrize("height", [0.9, 1.4, 2.2])
def test_an_endless_depth_image_says_nothing_of_any_furniture(furniture, height):
    builder = LookBuilder({3: furniture, 4: FLOOR})
    for number, pose in enumerate(look_around(furniture.center, height=height)[:8]):
        assert not builder.frame(0.2 * number, pose, CAMERA, (), ENDLESS)
    assert list(builder.finish()) == []


def test_a_table_that_depth_goes_through_in_part_was_seen_in_part():
    """A black half of the table returns nothing, which the driver calls infinity."""
    pose = Pose.look_at((1.9, 0.0, 2.4), TABLE.center)  # from above: rays to its half end on it
    shares = []
    for end in (CAMERA.width // 2, 0):
        depth = render([TABLE, FLOOR], pose)
        depth[:, :end] = np.inf
        builder = LookBuilder({7: TABLE})
        for number in range(4):
            builder.frame(0.2 * number, pose, CAMERA, (), depth)
        shares += [look.coverage["onTop"] for look in builder.finish()]
    half, whole = shares
    # Rays through points high above its edges pass by it: what they meet is no matter of the map.
    assert 0.45 * whole < half < 0.7 * whole


def test_a_table_that_was_carried_off_is_not_an_empty_table():
    builder = LookBuilder({7: TABLE, 8: FLOOR})
    for number, pose in enumerate(POSES):
        builder.frame(0.2 * number, pose, CAMERA, (), render([FLOOR], pose))
    assert [look.furniture for look in builder.finish()] == [8]
    assert builder.counts["places that depth goes through"] == len(POSES)


def test_free_space_below_a_table_and_above_it_is_free():
    """A top of 4 cm: rays from near the floor go through the box of the table to the floor."""
    top = Box((2.0, 0.0, 0.68), (0.8, 1.2, 0.04))
    builder = LookBuilder({7: TABLE, 8: FLOOR})
    for number in range(5):
        pose = Pose.look_at((0.2, 0.1 * number, 0.4), (2.5, 0.0, 0.0))
        assert builder.frame(0.2 * number, pose, CAMERA, (), render([top, FLOOR], pose))
    assert 8 in [look.furniture for look in builder.finish()]
    assert "places that depth goes through" not in builder.counts


def test_a_map_that_is_drawn_is_not_held_against_an_endless_image():
    memory = SceneGraphMemory()
    mapper = FurnitureMapper(memory)
    builder = LookBuilder(discover=mapper)
    for number, pose in enumerate(look_around(TABLE.center)):
        found = [detect("table", TABLE, pose)]
        builder.frame(0.2 * number, pose, CAMERA, found, render([TABLE, FLOOR], pose))
    for look in builder.finish():
        look.tell(memory)
    for number, pose in enumerate(look_around(TABLE.center, num=60)):
        builder.frame(100 + 0.2 * number, pose, CAMERA, (), ENDLESS)
    list(builder.finish())
    assert [piece.label for piece in memory.layout.furniture.values()] == ["table"]
    assert builder.counts["depth through furniture"] == 60

"""A map that draws itself: furniture, spots, jumps of the pose, doors, and odd detections."""

import math
from collections import Counter

import numpy as np
import pytest

from sgm import SceneGraphMemory
from sgm.camera.camera_view import CameraView
from sgm.camera.depth_image import DepthImage
from sgm.camera.scene import Scene
from sgm.camera.silhouettes import Silhouettes
from sgm.eyes import Box, Detection, FurnitureLabels, FurnitureMapper, LookBuilder, MapRules, Pose
from sgm.layout.areas import Areas
from sgm.layout.turns import make_upright_turn
from sgm.mapping.box_fit import compute_likeness, compute_overlaps, fit_boxes
from sgm.mapping.data_association import DataAssociation
from sgm.mapping.furniture_points import measure_furniture
from sgm.mapping.landmark import Landmark
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, detect, look_around, put_on, render

SOFA = Box((2.0, 2.6, 0.25), (0.9, 1.8, 0.5), -math.pi / 2)


class Walk:
    """Looks at things and furniture, as a detector names them, with a clock of its own."""

    def __init__(self, builder):
        self.builder, self.time = builder, 0.0

    def see(self, poses, furniture, things=(), shift=(0.0, 0.0, 0.0), also=()):
        solid = [FLOOR, *(box for _, box in furniture), *(box for _, box in things)]
        for pose in poses:
            found = [detect(name, box, pose) for name, box in (*furniture, *things)]
            depth = render(solid, pose)
            said = Pose(pose.rotation, pose.position + np.array(shift))
            self.builder.frame(self.time, said, CAMERA, [*found, *also], depth)
            self.time += 0.2

    def tell(self, memory):
        looks = list(self.builder.finish())
        for look in looks:
            look.tell(memory)
        return looks


def make(**options):
    memory = SceneGraphMemory()
    mapper = FurnitureMapper(memory, **options)
    return memory, mapper, Walk(LookBuilder(discover=mapper))


def compute_overlap(box, other):
    """Footprints of two boxes along the axes of the map: their intersection over their union."""
    low = np.maximum(box.corners.min(axis=0), other.corners.min(axis=0))
    high = np.minimum(box.corners.max(axis=0), other.corners.max(axis=0))
    both = np.prod(np.maximum(high - low, 0))
    return both / (np.prod(box.size[:2]) + np.prod(other.size[:2]) - both)


def test_furniture_gets_a_place_with_extents():
    memory, mapper, walk = make()
    mug = put_on(TABLE, -0.2, 0.1)
    walk.see(look_around(TABLE.center, num=20), [("Dining_Table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    (number,) = memory.furniture_ids
    row = memory.layout.furniture[number]
    assert (row.label, memory.describe(number)) == ("dining table", "dining table in home")
    assert compute_overlap(row.box, TABLE) > 0.7
    assert row.box.top == pytest.approx(TABLE.top, abs=0.04)
    seen = memory.last_seen("mug")
    assert (seen.furniture, seen.relation) == (number, "onTop")
    assert mapper.counts["furniture found"] == 1
    assert mapper.is_found(number)
    # What is gone is noticed, as with a map that was given.
    memory.step()
    walk.time += 100
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)])
    walk.tell(memory)
    assert not memory.last_seen("mug").is_there


def test_a_glimpse_or_one_side_is_not_believed():
    memory, mapper, walk = make()
    walk.see(look_around(TABLE.center, num=20)[:4], [("table", TABLE)])  # too few frames
    walk.tell(memory)
    walk.see([look_around(SOFA.center)[0]] * 20, [("sofa", SOFA)])  # from one place alone
    walk.tell(memory)
    assert "furniture found" not in mapper.counts


def test_what_lies_on_nothing_known_lies_on_a_spot_and_goes_over():
    memory, mapper, walk = make(rules=MapRules(least_frames=30))
    mug = put_on(TABLE, -0.2, 0.1)
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    spot = memory.last_seen("mug").furniture
    assert memory.layout.furniture[spot].label == "spot"
    assert mapper.counts["spots"] == 1
    walk.time += 100
    memory.step()
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    seen = memory.last_seen("mug")
    assert memory.layout.furniture[seen.furniture].label == "table"
    assert spot not in memory.furniture_ids
    assert seen.times_seen >= 2


def test_a_spot_is_named_by_what_is_near():
    memory, _, walk = make()
    slippers = Box((1.2, 0.9, 0.05), (0.25, 0.2, 0.1))  # on the floor, beside the table
    poses = look_around((1.7, 0.3, 0.3), radius=2.0, num=24)
    walk.see(poses, [("table", TABLE)], [("slippers", slippers)])
    walk.tell(memory)
    seen = memory.last_seen("slippers")
    assert memory.describe(seen.furniture) == "floor by the table in home"
    assert memory.layout.furniture[seen.furniture].label == "floor"


@pytest.mark.parametrize("bearing", [0.2, 1.5, 3.0, 4.6])
@pytest.mark.parametrize("height", [0.05, 0.6])
def test_a_spot_is_looked_at_from_where_it_was_seen(bearing, height):
    """What is on its other sides, such as a wall, is not known."""
    memory, _, walk = make()
    slippers = Box((1.2, 0.9, height), (0.25, 0.2, 0.1))
    poses = look_around(slippers.center, num=24, turn=0.5, start=bearing)
    walk.see(poses, [], [("slippers", slippers)])
    away = [Pose.look_at(poses[-1].position, 2 * poses[-1].position - slippers.center)] * 60
    walk.see(away, [], [])  # turned around, and its map is settled meanwhile
    walk.tell(memory)
    seen = memory.last_seen("slippers")
    x, y, yaw = memory.get_pose(seen.furniture, seen.position)
    ahead = np.array([slippers.center[0] - x, slippers.center[1] - y])
    assert yaw == pytest.approx(math.atan2(ahead[1], ahead[0]), abs=0.1)
    assert 0.6 < np.hypot(*ahead) < 1.5
    assert ahead @ [math.cos(bearing), math.sin(bearing)] < -0.5


def test_what_lies_on_the_floor_moves_no_stand_before_furniture():
    memory, _, walk = make()
    poses = look_around(TABLE.center, num=24)
    walk.see(poses, [("table", TABLE)])
    walk.tell(memory)
    (table,) = memory.furniture_ids
    before = memory.get_pose(table)
    walk.time += 20
    slippers = Box((1.2, 0.9, 0.05), (0.25, 0.2, 0.1))
    walk.see(
        look_around((1.7, 0.3, 0.3), radius=2.0, num=24),
        [("table", TABLE)],
        [("slippers", slippers)],
    )
    walk.tell(memory)
    assert memory.describe(memory.last_seen("slippers").furniture) == "floor by the table in home"
    assert memory.get_pose(table) == pytest.approx(before, abs=0.2)


def test_two_pieces_and_names_that_are_wrong_now_and_then():
    memory, _, walk = make()
    for center in (TABLE.center, SOFA.center):
        poses = look_around(center, radius=2.2, num=24)
        for number, pose in enumerate(poses):
            name = "fridge" if number % 8 == 0 else "couch"
            walk.see([pose], [("table", TABLE), (name, SOFA)])
        walk.time += 20  # it drives over
    walk.tell(memory)
    rows = {row.label: row.box for row in memory.layout.furniture.values()}
    assert sorted(rows) == ["sofa", "table"]
    assert compute_overlap(rows["sofa"], SOFA) > 0.6
    assert compute_overlap(rows["table"], TABLE) > 0.6


def test_a_jump_of_the_pose_moves_nothing():
    memory, mapper, walk = make()
    mug = put_on(TABLE, -0.2, 0.1)
    poses = look_around(TABLE.center, num=20)
    walk.see(poses, [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    before = memory.layout.furniture
    walk.see(poses, [("table", TABLE)], [("mug", mug)])
    walk.see(poses, [("table", TABLE)], [("mug", mug)], shift=(3.0, 0.0, 0.0))
    walk.tell(memory)
    assert memory.layout.furniture == before
    assert mapper.counts["jumps of the pose"] >= 1
    assert walk.builder.counts["pose jumped"] == 19  # the first is too fast
    walk.see(poses, [("table", TABLE)], [("mug", mug)])  # it is where it was again
    walk.tell(memory)
    assert memory.layout.furniture == before
    assert walk.builder.counts["pose jumped"] < 30


def test_a_map_that_has_moved_for_good_is_drawn_anew():
    """Nothing is seen where it stood any more: after a minute the new pose is believed."""
    memory, mapper, walk = make()
    poses = look_around(TABLE.center, num=20)
    walk.see(poses, [("table", TABLE)])
    walk.see(poses, [("table", TABLE)], shift=(3.0, 0.0, 0.0))
    walk.tell(memory)
    assert mapper.counts["jumps of the pose"] == 1
    assert len(memory.boxes) == 1
    walk.time += 60
    walk.see(poses, [("table", TABLE)], shift=(3.0, 0.0, 0.0))
    walk.tell(memory)
    middles = sorted(box.center[0] for box in memory.boxes.values())
    assert middles == [pytest.approx(2.0, abs=0.1), pytest.approx(5.0, abs=0.1)]


@pytest.mark.parametrize(
    ("angle", "shift"), [(0.0, (3.0, 0.0)), (0.0, (0.3, 0.0)), (2.0, (-1.0, 4.0))]
)
def test_a_map_that_is_transformed_goes_on_in_its_new_frame(angle, shift):
    memory, mapper, walk = make()
    mug, poses = put_on(TABLE, -0.2, 0.1), look_around(TABLE.center, num=20)
    walk.see(poses, [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    (number,) = memory.furniture_ids
    before, at = memory.boxes[number], memory.last_seen("mug").position
    memory.transform(angle, shift)
    walk.builder.set_furniture(memory.layout.furniture)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    around = np.eye(3)
    around[:2, :2] = turn
    for pose in poses:
        found = [detect("table", TABLE, pose), detect("mug", mug, pose)]
        said = Pose(around @ pose.rotation, around @ pose.position + [*shift, 0])
        walk.builder.frame(walk.time, said, CAMERA, found, render([FLOOR, TABLE, mug], pose))
        walk.time += 0.2
    walk.tell(memory)
    box = memory.boxes[number]
    assert memory.furniture_ids == (number,)
    np.testing.assert_allclose(box.center[:2], turn @ before.center[:2] + shift, atol=0.02)
    assert math.remainder(box.yaw - before.yaw - angle, math.pi / 2) == pytest.approx(0, abs=0.1)
    assert box.size == pytest.approx(before.size, abs=0.04)
    position = memory.last_seen("mug").position
    np.testing.assert_allclose(position[:2], turn @ at[:2] + shift, atol=0.02)
    assert "furniture that jumped" not in mapper.counts


def test_furniture_that_a_person_has_drawn_anew_is_left_as_it_is():
    memory, mapper, walk = make()
    poses = look_around(TABLE.center, num=20)
    walk.see(poses, [("table", TABLE)])
    walk.tell(memory)
    (number,) = memory.furniture_ids
    own = Box((2.1, 0.0, 0.36), (0.9, 1.4, 0.72))
    memory.move_furniture(number, box=own)
    walk.builder.set_furniture(memory.layout.furniture)
    walk.see(poses, [("table", TABLE)])
    walk.tell(memory)
    assert memory.boxes == {number: own}
    assert not mapper.is_found(number)


def test_a_crowd_of_detections_and_frames_out_of_order_are_counted():
    memory, mapper, walk = make()
    poses, rng = look_around(TABLE.center, num=6, turn=0.1), np.random.default_rng(0)
    corner, side = rng.uniform(0, 100, (999, 2)), rng.uniform(0, 40, (999, 2))
    names = ["Couches", "Стол", "mug"]
    crowd = [
        Detection(names[n % 3], 0.9, box=(*a, *(a + b)))
        for n, (a, b) in enumerate(zip(corner, side, strict=True))
    ]
    walk.see(poses, [("TABLES", TABLE)], also=crowd)
    assert walk.builder.counts["detections of furniture"] == 6 * (333 + 1)
    beyond = mapper.counts["detections of furniture beyond what is read"]
    assert beyond == 6 * (334 - 100)
    for time in (0.1, 0.3):
        assert not walk.builder.frame(time, poses[0], CAMERA, crowd)
    assert walk.builder.counts["time went back"] == 2
    walk.tell(memory)


def test_negative_depth_is_a_hole():
    memory, _, walk = make()
    poses = look_around(TABLE.center, num=20)
    for pose in poses:
        depth = render([TABLE, FLOOR], pose)
        depth[::2], depth[:, ::3] = -1.0, -np.inf
        walk.builder.frame(walk.time, pose, CAMERA, [detect("Tables", TABLE, pose)], depth)
        walk.time += 0.2
    walk.tell(memory)
    ((_, box),) = memory.boxes.items()
    assert compute_overlap(box, TABLE) > 0.7
    walk.builder.frame(walk.time + 100, poses[0], CAMERA, (), np.full_like(depth, -3.0))
    assert list(walk.builder.finish()) == []


def test_doors_are_unknown_until_they_are_told():
    memory, _, walk = make()
    walk.see(look_around(SOFA.center, num=20), [("cabinet", SOFA)])
    walk.tell(memory)
    (number,) = memory.furniture_ids
    assert memory.layout.furniture[number].box.interior == "none"
    walk.builder.set_open(number)
    assert memory.layout.furniture[number].box.interior == "door"
    walk.builder.set_open(number, is_open=False)
    walk.see(look_around(SOFA.center, num=20), [("cabinet", SOFA)])
    walk.tell(memory)
    assert memory.layout.furniture[number].box.interior == "door"  # it stays


def test_furniture_of_the_map_is_left_as_it_is():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    drawn = Box((2.05, 0.0, 0.35), (0.9, 1.3, 0.7))
    table = memory.add_furniture("table", kitchen, box=drawn)
    walk = Walk(LookBuilder(discover=FurnitureMapper(memory)))
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)])
    walk.tell(memory)
    assert memory.furniture_ids == (table,)
    assert memory.layout.furniture[table].box == drawn


@pytest.mark.parametrize("empty", [[], None, {"polygon": []}, {"polygon": None}, {"other": 1}])
def test_an_area_without_corners_is_left_out_and_said(empty):
    kitchen = [[0, 0], [4, 0], [4, 3], [0, 3]]
    with pytest.warns(UserWarning, match=r"left out, \['hall'\] in areas.yaml"):
        areas = Areas.from_values({"kitchen": kitchen, "hall": empty}, "areas.yaml")
    assert areas.names == ("kitchen",)
    assert areas.find((1, 1)) == "kitchen"
    with pytest.raises(ValueError, match="area 'hall' must"):
        Areas.from_values({"hall": empty})  # nothing would be left


def test_rooms_are_polygons():
    areas = Areas({"kitchen": [[-3, -3], [5, -3], [5, 1.5], [-3, 1.5]],
                   "den": [[-3, 1.5], [5, 1.5], [5, 4], [-3, 4]]})  # fmt: skip
    memory, _, walk = make(areas=areas)
    for center, name, box in ((TABLE.center, "table", TABLE), (SOFA.center, "sofa", SOFA)):
        walk.see(look_around(center, num=20), [(name, box)])
        walk.tell(memory)
    assert sorted(map(memory.describe, memory.furniture_ids)) == ["sofa in den", "table in kitchen"]
    assert Areas().find((0, 0)) == "home"
    assert areas.find((50, 50)) == "home"
    for data in (
        {"kitchen": [{"x": 0, "y": 0}, {"x": 4, "y": 0}, {"x": 0, "y": 4}]},
        {"areas": [{"name": "kitchen", "polygon": [[0, 0], [4, 0], [0, 4]]}]},
        {"kitchen": {"polygon": [[0, 0], [4, 0], [0, 4]], "note": 1}},
        {"regions": [{"name": "kitchen", "points": [[0, 0], [4, 0], [0, 4]]}]},
    ):
        assert Areas.from_values(data).find((1, 1)) == "kitchen"
    for data in ({}, [1], "x", {"kitchen": 3}, {"kitchen": [[0, 0], [1, 1]]}, {"": [[0, 0]] * 3}):
        with pytest.raises(ValueError, match=r"area|polygon|non-empty"):
            Areas.from_values(data, "areas.yaml")


def test_odd_detections_end_in_no_furniture():
    memory, mapper, walk = make(labels=FurnitureLabels({"table": ["mesa"]}))
    poses = look_around(TABLE.center, num=20)
    odd = [
        Detection("fridge", 0.9, box=(10, 10, 10, 10)),  # of no size
        Detection("sofa", 0.9, center=(1, 1, 1)),
        Detection("bed", 0.9, center=(1, 1, 1), size=(0, 0, 0)),
        Detection("冷蔵庫", 0.9, box=(5, 5, 6, 6)),
        Detection("closet", 0.9, box=(-500, -500, 900, 900)),
    ]
    walk.see(poses, [("mesa", TABLE)], also=odd)
    for _ in range(2):  # two frames of one time
        walk.builder.frame(walk.time, poses[0], CAMERA, odd)
    walk.tell(memory)
    labels = [
        memory.layout.furniture[number].label
        for number in memory.furniture_ids
        if mapper.is_found(number)
    ]
    assert "table" in labels
    assert set(labels) <= {"table", "closet"}
    assert walk.builder.counts["frame came twice"] == 1


def test_bad_arguments_are_one_line():
    with pytest.raises(TypeError, match="discover must be a FurnitureMapper"):
        LookBuilder(discover=True)
    with pytest.raises(TypeError, match="furniture must be a mapping, got None"):
        LookBuilder()
    with pytest.raises(ValueError, match="least_frames must be at least 1"):
        MapRules(least_frames=0)


def test_furniture_that_was_seen_in_part_grows_to_all_of_it():
    """Of a counter of 2.4 m its end was seen first: its middle moves by a metre, and that is no
    jump.
    """
    counter = Box((2.0, 0.0, 0.45), (0.6, 2.4, 0.9))
    end = Box((2.0, 1.0, 0.45), (0.6, 0.4, 0.9))
    memory, mapper, walk = make()
    walk.see(look_around(end.center, num=20), [("counter", end)])
    walk.tell(memory)
    (number,) = memory.furniture_ids
    assert memory.boxes[number].center[1] == pytest.approx(1.0, abs=0.1)
    walk.time += 100
    for _ in range(2):
        walk.time += 20
        walk.see(look_around(counter.center, radius=2.4, num=40), [("counter", counter)])
    walk.tell(memory)
    assert "furniture that jumped" not in mapper.counts
    assert memory.furniture_ids == (number,)
    assert compute_overlap(memory.boxes[number], counter) > 0.6


def test_furniture_that_is_carried_off_leaves_the_map():
    memory, mapper, walk = make()
    mug = put_on(TABLE, -0.2, 0.1)
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    walk.time += 20
    assert [row.label for row in memory.layout.furniture.values()] == ["table"]
    walk.see(look_around(TABLE.center, num=60), [])
    walk.tell(memory)
    assert mapper.counts["furniture gone"] == 1
    assert "table" not in {row.label for row in memory.layout.furniture.values()}
    walk.time += 20
    walk.see(look_around(TABLE.center, num=60), [])
    walk.tell(memory)  # nothing lies there: there is no spot either
    assert not memory.layout.furniture
    assert memory.last_seen("mug").furniture is None


def test_how_long_furniture_must_be_missed_is_a_rule():
    memory, mapper, walk = make(rules=MapRules(least_shown=200))
    for detections in ([("table", TABLE)], []):
        walk.see(look_around(TABLE.center, num=60), detections)
        walk.tell(memory)
        walk.time += 20
    assert "furniture gone" not in mapper.counts
    assert [row.label for row in memory.layout.furniture.values()] == ["table"]


def test_furniture_that_is_not_there_leaves_a_spot_where_things_lie():
    memory, mapper, walk = make()
    mug = put_on(TABLE, -0.2, 0.1)
    walk.see(look_around(TABLE.center, num=20), [("table", TABLE)], [("mug", mug)])
    walk.tell(memory)
    bench = Box(TABLE.center, TABLE.size)  # the detector has no name for it
    for _ in range(3):
        walk.time += 20
        for pose in look_around(TABLE.center, num=30):
            walk.see([pose], [], [("mug", mug), ("bench of marble", bench)])
        walk.tell(memory)
    assert mapper.counts["furniture gone"] == 1
    seen = memory.last_seen("mug")
    assert seen.is_there
    assert memory.layout.furniture[seen.furniture].label == "spot"


def make_view(solid, pose, farthest=4.0):
    return CameraView(
        Scene({}), pose, CAMERA, DepthImage(render(solid, pose), CAMERA), (0.2, farthest)
    )


def test_what_stands_before_furniture_that_is_out_of_reach_is_not_it():
    pose = Pose.look_at((-2.0, 0.0, 1.2), (2.0, 0.0, 0.5))
    far = Box((4.0, 0.0, 0.5), (0.8, 2.0, 1.0))
    post = Box((0.0, 0.35, 0.5), (0.1, 0.3, 1.6))  # before a third of it
    found = detect("sofa", far, pose)
    ((points, _),) = measure_furniture(make_view([far, post], pose), [found], [], 0.0)
    assert not len(points)
    ((points, _),) = measure_furniture(make_view([far, post], pose, 9.0), [found], [], 0.0)
    assert len(points)


def test_points_are_of_furniture_and_not_of_what_lies_on_it():
    pose = Pose.look_at((0.5, 0.0, 1.4), TABLE.center)
    mug = put_on(TABLE, 0.0, 0.0, (0.3, 0.3, 0.3))
    view = make_view([FLOOR, TABLE, mug], pose)
    table, thing = detect("table", TABLE, pose), detect("mug", mug, pose)
    ((points, is_within),) = measure_furniture(view, [table], [thing], 0.0)
    assert (points[is_within][:, 2] < TABLE.top + 0.01).all()
    ((points, is_within),) = measure_furniture(view, [table], [], 0.0)
    assert (points[is_within][:, 2] > TABLE.top + 0.1).any()
    sized = Detection("table", 0.9, center=TABLE.center, size=TABLE.size)
    bare = Detection("table", 0.9, center=TABLE.center)
    (points, is_within), (none, _) = measure_furniture(view, [sized, bare], [], 0.0)
    assert is_within.all()
    assert np.abs((points - TABLE.center) / TABLE.size).max(axis=1) == pytest.approx(0.5)
    assert not len(none)


def test_overlaps_of_many_boxes_are_those_of_each():
    rng = np.random.default_rng(0)
    pose = Pose.look_at((0.5, 0.3, 1.4), TABLE.center)
    view = make_view([TABLE], pose)
    boxes = [
        Box(tuple(rng.uniform((1, -1, 0), (3, 1, 1))), tuple(rng.uniform(0.2, 1.2, 3)), turn)
        for turn in rng.uniform(-3, 3, 20)
    ]
    seen = np.sort(rng.uniform(0, 120, (20, 2, 2)), axis=1).reshape(20, 4)
    overlaps = compute_overlaps(view, boxes, seen)
    assert (overlaps > 0).any()
    for box, pixels, overlap in zip(boxes, seen, overlaps, strict=True):
        one = Silhouettes()
        one.add(view, tuple(pixels))
        assert compute_likeness([one], [box]) == pytest.approx(overlap)


def test_a_box_is_moved_to_where_it_explains_what_was_seen():
    """From all round, with sides that are wrong by 10 cm."""
    looks = Silhouettes()
    for pose in look_around(TABLE.center, num=12, turn=6.0):
        looks.add(make_view([TABLE], pose), detect("table", TABLE, pose).box)
    wrong = Box((2.1, 0.05, 0.4), (0.7, 1.4, 0.8))
    (fitted,) = fit_boxes([looks], [wrong], 0.0)
    before, after = compute_likeness([looks, looks], [wrong, fitted])
    assert after > before + 0.05
    assert np.abs(np.array(fitted.center) - TABLE.center).max() < 0.06
    assert fitted.bottom >= -1e-6  # not in the floor


def test_boxes_that_are_fitted_at_once_are_those_that_are_fitted_each():
    """More than are fitted at once, with other numbers of frames, and one that none shows."""
    rng = np.random.default_rng(0)
    looks, boxes = [], []
    for number in range(20):
        seen = Silhouettes()
        for pose in look_around(TABLE.center, num=number, turn=6.0):
            seen.add(make_view([TABLE], pose), detect("table", TABLE, pose).box)
        looks.append(seen)
        center = np.array(TABLE.center) + rng.normal(0, 0.1, 3)
        boxes.append(Box(tuple(center), tuple(rng.uniform(0.5, 1.5, 3)), rng.uniform(-3, 3)))
    together = fit_boxes(looks, boxes, 0.0)
    assert together[0] == boxes[0]
    for seen, box, fitted in zip(looks, boxes, together, strict=True):
        (alone,) = fit_boxes([seen], [box], 0.0)
        assert alone.center == pytest.approx(fitted.center)
        assert alone.size == pytest.approx(fitted.size)
    assert (compute_likeness(looks, together) >= compute_likeness(looks, boxes)).all()


def test_what_was_seen_moves_with_the_map():
    looks = Silhouettes()
    for pose in look_around(TABLE.center, num=12, turn=6.0):
        looks.add(make_view([TABLE], pose), detect("table", TABLE, pose).box)
    before = compute_likeness([looks], [TABLE])
    turn, shift = make_upright_turn(0.7), np.array([1.0, -2.0, 0.3])
    looks.move(turn, shift)
    moved = Box(tuple(turn @ TABLE.center + shift), TABLE.size, TABLE.yaw + 0.7)
    assert compute_likeness([looks], [moved]) == pytest.approx(before)
    assert compute_likeness([looks], [TABLE]) < before - 0.3


def test_furniture_behind_other_furniture_is_that_which_was_seen_before():
    """Most of its box in pixels shows what stands before it; the box itself is where it was."""
    pose = Pose.look_at((0.0, 0.0, 1.0), TABLE.center)
    front = Box((1.1, 0.1, 0.375), (0.1, 1.2, 0.75))
    view, label = make_view([FLOOR, TABLE, front], pose), "table"
    table = detect("table", TABLE, pose)
    shown = measure_furniture(view, [table], [], 0.0)
    ((points, is_within),) = shown
    share = TABLE.contains(points[is_within], 0.15).mean()
    assert 0.1 < share < 0.3
    landmark, other = Landmark(0, Counter(table=1)), Landmark(1, Counter(table=1))
    landmark.box, other.box = TABLE, Box((2.0, 0.9, 0.35), (0.8, 0.6, 0.7))
    matches = DataAssociation([other, landmark], FurnitureLabels(), view)
    matches.prepare([table], [label], shown, [0])
    assert matches.find(0, set()) is landmark
    assert matches.find(0, {0}) is None


def test_furniture_has_names_of_its_own_after_some_became_one():
    memory, _, walk = make()
    tables = [Box((2.0, y, 0.35), (0.6, 0.6, 0.7)) for y in (-1.5, 0.0, 1.5)]
    for table in tables:
        walk.see(look_around(table.center), [("table", table)])
        walk.tell(memory)
    first, second, _ = memory.furniture_ids
    memory.merge_furniture(first, second)
    more = Box((2.0, 3.0, 0.35), (0.6, 0.6, 0.7))
    walk.see(look_around(more.center), [("table", more)])
    walk.tell(memory)
    names = [row.description for row in memory.layout.furniture.values()]
    assert len(names) == len(set(names)) == 3

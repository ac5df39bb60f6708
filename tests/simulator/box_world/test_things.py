import numpy as np
import pytest

from sgm.camera.pinhole import Pose
from sgm.layout.box import Box
from sgm.schema import RELATIONS, PlaceCode
from simulator.box_world.depth_camera import BoxDetector, DepthCamera
from simulator.box_world.ray_kernel import find_hidden
from simulator.box_world.true_view import TrueView, sample_cells
from simulator.box_world.world import BoxWorld
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def _check_places(world):
    homes, things = world.homes, world.things
    np.testing.assert_array_equal(things.place >= 0, homes.object_place[0] >= 0)
    for slot in np.flatnonzero(things.place >= 0):
        furniture, relation = PlaceCode.split(int(things.place[slot]))
        assert furniture == PlaceCode.furniture(homes.object_place[0, slot])
        volume = world.floor.furniture[furniture].volume(RELATIONS[relation])
        assert volume.contains(things.center[slot], 0.02), RELATIONS[relation]


def test_things_lie_where_the_home_has_them_and_stay_on_their_spots(make_world):
    world = make_world(home=1)
    for _ in range(6):
        _check_places(world)
        before, center = world.homes.object_place.copy(), world.things.center.copy()
        code = world.homes.object_code.copy()
        world.evolve()
        has_stayed = ((before == world.homes.object_place) & (code == world.homes.object_code))[0]
        assert has_stayed.sum() > 20
        np.testing.assert_array_equal(world.things.center[has_stayed], center[has_stayed])
        assert (world.things.center[~has_stayed] != center[~has_stayed]).any()


def test_few_things_overlap(make_world):
    world = make_world(furniture=6, things=6)
    things = world.things
    num_pairs = num_overlaps = 0
    for place in np.unique(things.place[things.place >= 0]):
        own = np.flatnonzero(things.place == place)
        for first, second in zip(*np.triu_indices(len(own), 1), strict=True):
            a, b = own[first], own[second]
            gap = np.abs(things.center[a] - things.center[b]) - things.half[a] - things.half[b]
            turned = world.floor.furniture[PlaceCode.furniture(place)].yaw % np.pi > 0.1
            if turned:  # sides along the furniture's axes, which are those of the map, swapped
                reach = (things.half[a] + things.half[b])[[1, 0, 2]]
                gap = np.abs(things.center[a] - things.center[b]) - reach
            num_pairs += 1
            num_overlaps += bool((gap < -1e-6).all())
    assert num_pairs > 100
    assert num_overlaps <= 0.02 * num_pairs


@pytest.mark.slow
def test_a_home_of_boxes_lives_as_the_same_home_without_boxes():
    config = HomeConfig(furniture_per_room=4, objects_per_furniture=3, dynamics=RoutineDynamics())
    plain = SampledSource(home=config).make(Streams(0, "test", [2]))
    world = BoxWorld(SampledSource(home=config).make(Streams(0, "test", [2])))
    for _ in range(24):
        plain.evolve()
        world.evolve()
        np.testing.assert_array_equal(plain.object_place, world.homes.object_place)
    _check_places(world)


def test_a_world_is_one_home():
    homes = SampledSource(home=HomeConfig(furniture_per_room=2)).make(Streams(0, "test", [0, 1]))
    with pytest.raises(ValueError, match=r"one home, got 2\. Make one"):
        BoxWorld(homes)


def test_nobody_sees_into_a_shut_fridge(make_world):
    world = make_world()
    camera = DepthCamera()
    (fridge, *_) = np.flatnonzero(world.homes.furniture_labels[0] == "fridge").tolist()
    box = world.floor.furniture[fridge]
    pose = Pose.look_at((*world.floor.find_stand(fridge), 1.3), (*box.center[:2], 0.9))
    view = TrueView(world, camera)
    view.add(1.0, pose)
    assert view.compute_coverage(fridge, "in") == 0
    world.open_doors.add(fridge)
    view.clear()
    view.add(1.0, pose)
    once = view.compute_coverage(fridge, "in")
    assert 0.2 < once < 1
    view.add(2.0, Pose.look_at((*world.floor.find_stand(fridge), 1.3), (*box.center[:2], 0.3)))
    assert view.compute_coverage(fridge, "in") > once  # what was in view in any frame counts
    assert view.compute_coverage(fridge, "in", 0.5, 1.5) == once
    assert view.compute_coverage(fridge, "in", 5.0) == 0
    world.evolve()
    assert not world.open_doors


def test_points_of_the_truth_lie_one_in_each_cell():
    """A table of 1 x .5 m: .2 m3 above it, 100 points of which make cells of .126 m.

    1 / .126, .5 / .126 and .4 / .126, rounded up, are 8, 4 and 4: 128 points.
    """
    box = Box((2.0, 1.0, 0.4), (1.0, 0.5, 0.8), yaw=0.3)
    rng = np.random.default_rng(0)
    points = sample_cells(box, "onTop", 100, rng=rng)
    cells = (box.to_own(points) + np.array([0.5, 0.25, -0.4])) * (8, 8, 10)
    assert sorted(map(tuple, np.floor(cells).astype(int).tolist())) == [
        (x, y, z) for x in range(8) for y in range(4) for z in range(4)
    ]
    assert len(sample_cells(box, "in", 100, rng=rng)) == 0
    shelf = Box(box.center, box.size, box.yaw, "open")
    assert shelf.inside.contains(sample_cells(shelf, "in", 100, rng=rng)).all()


def test_frames_that_show_a_point_are_counted(make_world):
    world = make_world()
    box = world.floor.furniture[0]
    view = TrueView(world, DepthCamera())
    above, below = (box.to_map(np.array([0, 0, z])) for z in (box.size[2] / 2 + 0.3, -5.0))
    for time in (1.0, 2.0, 3.0):
        view.add(time, Pose.look_at((*world.floor.find_stand(0), 1.4), above))
    assert view.count_frames(np.array([above, below]), 1.5, 9.0).tolist() == [2, 0]


def test_boxes_that_hide_lie_between(make_world):
    world, rng = make_world(), np.random.default_rng(0)
    solids = world.solids
    for _ in range(50):
        at = np.array([*rng.uniform(world.floor.low, world.floor.high), 1.4])
        points = at + rng.normal(0, 2.0, 3) + rng.normal(0, 0.3, (20, 3))
        few = solids.select_between(at, points)
        np.testing.assert_array_equal(find_hidden(few, at, points), find_hidden(solids, at, points))
    assert len(few.owner) < len(solids.owner)


def test_detector_by_hand():
    """100 of 100 pixels: .95 (1 - exp(-100 / 12)); 15 of 40 at .25: (15 / 40 / .25 - 1) = .5."""
    detector = BoxDetector()
    probability = detector.compute_probability(np.array([100, 15, 10]), np.array([100, 40, 40]))
    expected = [0.95 * (1 - np.exp(-100 / 12)), 0.95 * (1 - np.exp(-15 / 12)) * 0.5, 0.0]
    np.testing.assert_allclose(probability, expected)


def test_detector_sees_what_is_in_the_picture_and_names_some_wrongly(make_world):
    world, camera, rng = make_world(), DepthCamera(), np.random.default_rng(0)
    detector = BoxDetector(wrong_share=0.2)
    counts = np.zeros(3)
    for _ in range(40):
        for furniture, box in enumerate(world.floor.furniture[:4]):
            pose = Pose.look_at((*world.floor.find_stand(furniture), 1.3), box.center)
            shot = camera.shoot(world.solids, world.homes.num_slots, pose, rng=rng)
            for found in detector.detect(world, shot, rng=rng):
                left, top, right, bottom = found.detection.box
                own = np.argwhere(shot.owner == found.slot)
                assert len(own)
                middle = own.mean(axis=0)
                assert left - 3 < middle[1] < right + 3
                assert top - 3 < middle[0] < bottom + 3
                is_right = found.detection.name == world.describe_thing(found.slot)
                counts += (1, is_right, found.is_named)
    assert counts[0] > 300
    # 20 % are named after one of 50 things, itself among them; 4 standard deviations.
    assert abs(counts[2] / counts[0] - 0.8) < 4 * np.sqrt(0.16 / counts[0]) + 0.02
    assert counts[1] >= counts[2]

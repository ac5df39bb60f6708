import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.policies.adaptive import Adaptive
from simulator.box_world.floor import ROBOT_RADIUS
from simulator.box_world.ray_kernel import Solids
from simulator.box_world.robot_body import BodyRules, RobotBody
from simulator.box_world.robots import PerfectRobot, SeeingRobot, ShownRobot, make_memory
from simulator.box_world.week import Week, WeekRules


@pytest.fixture
def make_robot(make_small_world):
    def make(kind, **rules):
        world = make_small_world()
        body = RobotBody(world, BodyRules(**rules))
        return kind(body, make_memory(world), Finder(Adaptive()), most_looks=8)

    return make


def _list_names(robot, furniture):
    return sorted(robot.world.describe_thing(slot) for slot, _ in robot.world.list_there(furniture))


def test_perfect_looks_are_the_truth(make_robot):
    robot = make_robot(PerfectRobot)
    for furniture in range(robot.world.num_furniture):
        look = robot.look_at(furniture)
        assert sorted(one.description for one in look.seen) == _list_names(robot, furniture)
        assert look.coverage == {"in": 1.0, "onTop": 1.0}
        stand = np.array(robot.world.floor.find_stand(furniture))
        assert np.linalg.norm(np.array(robot.body.position) - stand) < 0.15


def test_what_shows_is_there_and_the_rest_is_hidden(make_robot):
    robot = make_robot(ShownRobot)
    num_hidden = 0
    for furniture in range(robot.world.num_furniture):
        look = robot.look_at(furniture)
        names = [one.description for one in look.seen]
        assert sorted({*names, *look.hidden}) == sorted(set(_list_names(robot, furniture)))
        num_hidden += len(look.hidden)
    assert num_hidden <= 2  # of 16 things
    # Behind a wall before its front, nothing shows.
    blind = make_robot(ShownRobot)
    box = blind.world.floor.furniture[0]
    front = box.to_map(np.array([box.size[0] / 2 + 0.3, 0.0, 0.0]))
    wall = Solids.of_boxes([Box(tuple(front), (0.02, 4.0, 8.0), box.yaw)], -1)
    blind.world._still = Solids.join([blind.world._still, wall])
    blind.world._solids = None
    assert blind.look_at(0).seen == ()


@pytest.mark.slow
def test_looks_of_eyes_are_near_the_truth(make_robot):
    robot = make_robot(SeeingRobot, position_sd=0.02, angle_sd=0.005)
    num_there = num_seen = num_false = 0
    for furniture in range(robot.world.num_furniture):
        look = robot.look_at(furniture)
        there = _list_names(robot, furniture)
        seen = {one.description for one in look.seen if one.confidence >= 0.5}
        num_there += len(set(there))
        num_seen += len(seen.intersection(there))
        num_false += len(seen.difference(there))
    assert num_there >= 12
    assert num_seen >= 0.85 * num_there
    assert num_false <= 1
    assert not robot.world.open_doors  # all are shut again


@pytest.mark.slow
@pytest.mark.parametrize("kind", [PerfectRobot, SeeingRobot, ShownRobot])
def test_what_was_just_seen_is_fetched_with_one_look(make_robot, kind):
    robot = make_robot(kind)
    for furniture in range(robot.world.num_furniture):
        look = robot.look_at(furniture)
        look.tell(robot.memory)
        sure = [one.description for one in look.seen if one.confidence > 0.9]
        if sure:
            break
    errand = robot.fetch(sure[0])
    assert errand.is_found
    assert errand.num_looks == 1
    assert robot.fetch("grand piano").is_found is False


def test_a_robot_keeps_away_from_walls_and_furniture(make_small_world):
    world = make_small_world()
    body = RobotBody(world)
    for furniture in range(world.num_furniture):
        for frame in (*body.drive(furniture), *body.look(furniture)):
            at = frame.true_pose.position.copy()
            for box in (*world.floor.furniture, *world.floor.walls):
                at[2] = box.center[2]
                assert box.compute_distance(at) > ROBOT_RADIUS - 0.1


def test_errors_of_the_known_position_have_their_size_and_last(make_small_world):
    body = RobotBody(make_small_world(), BodyRules(position_sd=0.1, angle_sd=0.02))
    errors = []
    for furniture in (0, 3, 5, 2, 7, 1, 6, 4) * 2:
        own = [frame.pose.position - frame.true_pose.position for frame in body.look(furniture)]
        assert np.linalg.norm(own[0] - own[1]) < 0.1  # from one frame to the next
        errors += own
        body.time += 100
        body.go_to(furniture)
    errors = np.array(errors)
    assert (errors[:, 2] == 0).all()
    # 16 visits of which each has an error of its own: .1 +- .1 / sqrt(2 x 32), 4 of these.
    assert abs(errors[:, :2].std() - 0.1) < 4 * 0.1 / np.sqrt(64)


@pytest.mark.slow
def test_two_robots_live_in_the_same_home(source):
    week = Week(source, 0, 2, WeekRules(steps=3), BodyRules(frames_per_aim=1))
    for _ in week.live():
        for name in ("all that shows", "perfect looks", "own map"):
            other = week.robots[name].world
            eyes = week.robots["eyes"].world
            np.testing.assert_array_equal(eyes.homes.object_place, other.homes.object_place)
            np.testing.assert_array_equal(eyes.things.center, other.things.center)
    first, second, third, last = (
        [one.description for one in tally.errands] for tally in week.tallies
    )
    assert last == first
    assert first == second == third
    assert len(first) == 3

import itertools
import math

import numpy as np
import pytest

from simulator.box_world.floor import DOOR, ROBOT_RADIUS, STANDOFF
from simulator.box_world.routes import CELL, FloorRoutes


def _get_rectangle(box):
    return box.corners.min(axis=0), box.corners.max(axis=0)


@pytest.mark.parametrize("home", range(3))
def test_furniture_stands_in_its_room_and_overlaps_nothing(make_world, home):
    world = make_world(home, furniture=6)
    floor = world.floor
    assert len(floor.furniture) == 24
    assert len(floor.rooms) == 4
    rectangles = [_get_rectangle(box) for box in floor.furniture]
    for number, (low, high) in enumerate(rectangles):
        room = floor.rooms[world.homes.furniture_room[0, number]]
        assert (low >= np.array(room.low) - 1e-9).all()
        assert (high <= np.array(room.high) + 1e-9).all()
        for other_low, other_high in rectangles[:number]:
            assert ((high <= other_low) | (other_high <= low)).any()
    for wall in floor.walls:
        low, high = _get_rectangle(wall)
        for other_low, other_high in rectangles:
            assert ((high <= other_low + 1e-9) | (other_high <= low + 1e-9)).any()


def test_doors_are_gaps_in_the_walls(make_world):
    floor = make_world().floor
    for room in floor.rooms:
        point = np.array([*room.door, 1.0])
        least = min(wall.compute_distance(point) for wall in floor.walls)
        assert math.isclose(least, DOOR / 2, abs_tol=0.06)  # up to half of the wall's thickness


@pytest.mark.parametrize("home", range(3))
def test_a_robot_comes_to_all_furniture(make_world, home):
    floor = make_world(home, furniture=6).floor
    routes = FloorRoutes(floor)
    at = floor.find_stand(0)
    for furniture, box in enumerate(floor.furniture):
        stand = np.array(floor.find_stand(furniture))
        distance = np.linalg.norm(stand - np.array(box.center[:2]))
        assert math.isclose(distance, box.size[0] / 2 + STANDOFF)
        assert math.isfinite(routes.compute_distance(at, furniture))
        path = routes.find_path(at, furniture)
        assert np.linalg.norm(path[-1] - stand) < 1.5 * CELL
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        assert length <= routes.compute_distance(at, furniture) + 1e-9  # corners are cut
        for start, end in itertools.pairwise(path):
            steps = start + (end - start) * np.linspace(0, 1, 50)[:, None]
            for other in (*floor.furniture, *floor.walls):
                points = np.column_stack([steps, np.full(50, other.center[2])])
                assert other.compute_distance(points).min() > ROBOT_RADIUS - CELL
        at = tuple(path[-1])


def test_routes_refuse_where_there_is_no_way(make_world):
    routes = FloorRoutes(make_world().floor)
    routes._towards[0, :] = -9999
    with pytest.raises(ValueError, match=r"furniture 0 can be reached from, got .*free floor"):
        routes.find_path((1.0, 0.0), 0)


def test_the_same_streams_give_the_same_home(make_world):
    first, second, other = make_world(), make_world(), make_world(home=1)
    assert first.floor == second.floor
    np.testing.assert_array_equal(first.things.center, second.things.center)
    assert first.floor != other.floor

"""Where rooms and furniture are drawn, from where they were looked at, and ways through doors."""

from itertools import combinations

import numpy as np
import pytest

from nep.view.page_state import Stage
from nep.view.plan_shapes import PlanShapes, find_outer_corners, list_ways, make_cone
from sgm.layout.box import Box
from sgm.layout.viewpoint import Viewpoint
from simulator import SceneGraphMemory
from simulator.drawing.floor_plan import FloorPlan
from simulator.igridson.floor_plan import make_plan
from simulator.igridson.layout_file import load_layout
from simulator.story.past_memory import StillMemory


def overlap(one, other):
    """Whether the boxes around two polygons share more than a border."""
    low = np.maximum(one.min(axis=0), other.min(axis=0))
    high = np.minimum(one.max(axis=0), other.max(axis=0))
    return bool((low < high - 1e-9).all())


def test_boxes_and_polygons_are_to_scale():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    around = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    ground = [(-1, -1), (6, -1), (6, 3), (-1, 3)]
    memory.add_furniture("counter", kitchen, box=Box.of_polygon(around, 0, 0.9))
    memory.add_furniture("table", kitchen, box=Box((4, 1, 0.4), (1, 2, 0.8)))
    memory.add_furniture("floor", kitchen, box=Box.of_polygon(ground, -0.1, 0))
    shapes = PlanShapes.of_memory(memory)
    counter, table, floor = shapes.outlines
    assert counter.tolist() == [list(map(float, corner)) for corner in around]
    assert {tuple(corner) for corner in table.tolist()} == {(4.5, 2), (3.5, 2), (3.5, 0), (4.5, 0)}
    assert floor.tolist() == shapes.room_outlines[0].tolist() == np.array(ground, float).tolist()
    assert shapes.is_to_scale == (True, True, True)
    assert shapes.has_floor == (True,)
    # Things of an L are drawn within one of its arms, and those of the floor where it is free.
    (x, y), side = shapes.insides[0, :2], shapes.insides[0, 2]
    assert min(x - side / 2, y - side / 2) >= 0
    assert (x + side / 2 <= 1 and y + side / 2 <= 2) or (x + side / 2 <= 2 and y + side / 2 <= 1)
    on_floor = shapes.insides[2, :2] + np.array([[-1, -1], [1, 1]]) * shapes.insides[2, 2:4] / 2
    assert not overlap(on_floor, table)


def test_boxes_around_points_cover_nothing():
    """Twelve pieces within a square metre, two at one position, beside a table with a box."""
    memory = SceneGraphMemory()
    kitchen, hall = memory.add_room("kitchen"), memory.add_room("hall")
    memory.add_furniture("table", kitchen, box=Box((1, 1, 0.4), (1.5, 1, 0.8)))
    at = np.random.default_rng(0).uniform(0, 1, (11, 2)).tolist()
    for position in [*at, at[0]]:
        memory.add_furniture("shelf", kitchen, position=position)
    memory.add_furniture("basket", kitchen)
    memory.add_furniture("bench", hall)
    shapes = PlanShapes.of_memory(memory)
    assert shapes.is_to_scale == (True,) + (False,) * 14
    sides = np.ptp(np.array(shapes.outlines[1:]), axis=1)
    assert (sides >= 0.4 - 1e-9).all()
    assert not [pair for pair in combinations(shapes.outlines, 2) if overlap(*pair)]
    assert shapes.has_floor == (False, False)
    low, high = (getattr(shapes.room_outlines[0], end)(axis=0) for end in ("min", "max"))
    own = np.concatenate(shapes.outlines[:-1])
    assert (low < own).all()
    assert (own < high).all()


def test_a_home_without_positions_is_laid_out_by_room():
    memory = SceneGraphMemory()
    for name in ("kitchen", "study"):
        room = memory.add_room(name)
        for _ in range(5):
            memory.add_furniture("shelf", room)
    shapes = PlanShapes.of_memory(memory)
    assert not shapes.has_positions
    assert not [pair for pair in combinations(shapes.outlines, 2) if overlap(*pair)]
    assert not overlap(*shapes.room_outlines)
    assert PlanShapes.of_memory(SceneGraphMemory()).to_json()["furniture"] == []


def make_rooms(doors):
    """Three rooms in a row, the left and the right one with a table, the middle one with none."""
    memory = SceneGraphMemory()
    for number in range(3):
        room = memory.add_room("office")
        floor = [(4 * number, 0), (4 * number + 4, 0), (4 * number + 4, 4), (4 * number, 4)]
        memory.add_furniture("floor", room, box=Box.of_polygon(floor, -0.1, 0))
        memory.add_furniture("desk", room, position=(4 * number + 2, 1))
    return Stage(lambda: StillMemory(memory, "home"), doors=doors).get_shapes(0)


def test_a_way_leads_through_doors():
    """From (2, 1) to (10, 1): by the lower doors 8 m, by one of the upper ones more."""
    shapes = make_rooms([(4, 3.5), (4, 1.5), (8, 1.5), (8, 3.5)])
    assert list_ways(shapes, [1, 5, 3]) == [[[4, 1.5], [8, 1.5]], [[8, 1.5]]]
    assert list_ways(shapes, [1, 1]) == [[]]
    assert list_ways(shapes, []) == list_ways(shapes, [3]) == []
    half = make_rooms([(4, 1.5)])
    assert list_ways(half, [1, 3]) == [[[4, 1.5]]]
    assert list_ways(half, [1, 5]) == [[]]  # there is no door: straight
    assert list_ways(make_rooms([]), [1, 5]) == [[]]
    with pytest.raises(ValueError, match="position must be two numbers, got"):
        make_rooms([("x", 1)])


def test_the_home_on_a_grid_is_to_scale_and_has_doors():
    layout = load_layout(None)
    shapes = PlanShapes.of_plan(make_plan(layout))
    sizes = [np.ptp(corners, axis=0).tolist() for corners in shapes.outlines]
    assert sizes == [[piece.width, piece.height] for piece in layout.furniture]
    assert len(shapes.doors) == layout.is_door.sum() > 0
    rooms = shapes.furniture_room
    other = int(np.flatnonzero(rooms != rooms[0])[0])
    assert list_ways(shapes, [0, other]) != [[]]
    plain = FloorPlan.make(["kitchen"], ["shelf"], np.zeros(1))
    assert PlanShapes.of_plan(plain).is_to_scale == (False,)


def test_a_look_that_says_from_where_it_was_has_the_cone_of_the_camera():
    """The table reaches from x = 2 to 4 and y = 1.5 to 2.5; the camera is at (5, 2), turned to -x.

    Its farthest corners are hypot(3, .5) = 3.04 m away; half of a right angle to both sides of -x
    are the directions (-1, -1) and (-1, 1) / sqrt 2: x = y - 2 = 3.04 / sqrt 2 = 2.15 m.
    """
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("table", kitchen, box=Box((3, 2, 0.4), (2, 1, 0.8)), position=(5, 2))
    memory.add_furniture("shelf", kitchen, position=(8, 2))
    shapes = PlanShapes.of_memory(memory)
    camera = Viewpoint(5.0, 2.0, 1.4, yaw=np.pi, angle=np.pi / 2, reach=4.0)
    cone = make_cone(shapes, 0, camera)
    assert np.round(cone, 3).tolist() == [[5, 2], [2.849, -0.151], [2.849, 4.151]]
    # Without it: from where one stands, between the outer corners of the table.
    assert make_cone(shapes, 0, None).tolist() == [[5, 2], [4, 2.5], [4, 1.5]]
    assert make_cone(shapes, 1, None) is None
    assert np.linalg.norm(make_cone(shapes, 1, camera)[1] - (5, 2)) == pytest.approx(4)


def test_outer_corners_by_hand():
    """From below, the lower corners are the outer ones; from beside a corner, its neighbours."""
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], dtype=float)
    below = find_outer_corners(np.array([0.0, -3.0]), square)
    assert below.tolist() == [[1, -1], [-1, -1]]
    aside = find_outer_corners(np.array([3.0, 3.0]), square)
    assert sorted(aside.tolist()) == [[-1, 1], [1, -1]]

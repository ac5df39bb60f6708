import numpy as np
import pytest

from sgm.layout.box import Box
from sgm.layout.furniture import Furniture, compute_position, compute_positions

FLOOR = Furniture("floor", 0, "floor", box=Box.of_floor((0, 0), (4, 4)))
# Its front looks along y, at y = .6.
FRIDGE = Furniture("fridge", 0, "fridge", box=Box((1, 0.3, 0.9), (0.6, 0.7, 1.8), np.pi / 2))


def test_one_stands_before_the_front():
    assert compute_positions({5: FRIDGE})[5] == pytest.approx((1, 1.3))  # .7 before it


def test_a_position_that_was_given_is_kept():
    given = Furniture("fridge", 0, "fridge", position=(9.0, 9.0), box=FRIDGE.box)
    assert compute_positions({5: given, 6: Furniture("table", 0, "table")}) == {
        5: (9.0, 9.0),
        6: None,
    }


def test_outside_all_boxes_and_on_the_floor_of_the_room():
    table = Furniture("table", 0, "table", box=Box((1, 1.6, 0.4), (1, 1, 0.8)))
    lamp = Furniture("lamp", 0, "lamp", box=Box((1, 1.3, 2.3), (0.4, 0.4, 0.4)))  # hangs high
    wall = Furniture("shelf", 0, "shelf", box=Box((3.7, 2, 1), (0.3, 4, 2)))
    furniture = {1: FLOOR, 5: FRIDGE, 6: table, 7: lamp, 8: wall}
    found = compute_positions(furniture)
    assert found == {number: compute_position(furniture, number) for number in furniture}
    points = np.array([found[number] for number in furniture])
    for number in (5, 6, 8):
        box = furniture[number].box
        flat = np.column_stack([points, np.full(len(points), box.center[2])])
        assert not box.contains(flat, 0.29).any()
    assert ((points >= 0) & (points <= 4)).all()
    assert found[5][1] < 0.6  # the table stands before the fridge: at its side


def test_nowhere_to_stand():
    block = Furniture("crate", 0, "crate", box=Box((1, 0.3, 1), (9, 9, 2)))
    assert compute_positions({5: FRIDGE, 6: block})[5] is None


def test_a_floor_is_looked_at_from_its_free_middle():
    assert compute_positions({1: FLOOR})[1] == pytest.approx((2, 2))
    table = Furniture("table", 0, "table", box=Box((2, 2, 0.4), (1, 1, 0.8)))
    x, y = compute_positions({1: FLOOR, 2: table})[1]
    assert 0.8 <= np.hypot(x - 2, y - 2) <= 1.2


def test_a_patch_of_floor_where_a_thing_lies_is_no_room():
    """Eyes without a map draw it around a shoe: one stands beside it, and elsewhere as before."""
    low, high = (2.3, 1.9), (2.9, 2.3)
    patch = Furniture("floor", 0, "floor by the fridge", box=Box.of_floor(low, high))
    for more in ({}, {1: FLOOR}):
        furniture = {5: FRIDGE, 6: patch, **more}
        found = compute_positions(furniture)
        assert found[5] == pytest.approx((1, 1.3))  # .7 before it, as without the patch
        x, y = found[6]
        assert not (low[0] <= x <= high[0] and low[1] <= y <= high[1])
        beside = compute_position(furniture, 6, (2.6, 2.1, 0.1))
        assert np.hypot(beside[0] - 2.6, beside[1] - 2.1) > 0.6

import math

import numpy as np
import pytest

from sgm.layout.box import Box
from sgm.layout.footprints import compute_shared_area, find_corner_near, get_area
from sgm.layout.turns import make_turn, make_upright_turn, turn_flat


def test_shared_areas_by_hand():
    """Of 2 x 1 m, a half lies in a box that begins in its middle, and is wider."""
    box, other = Box((0, 0, 0.5), (2, 1, 1)), Box((1.5, 0, 0.2), (3, 4, 0.4))
    assert get_area(box) == 2.0
    assert compute_shared_area(box, other) == pytest.approx(1.0)
    assert compute_shared_area(box, box) == pytest.approx(2.0)
    assert compute_shared_area(box, Box((5, 0, 0.5), (1, 1, 1))) == 0.0
    # A square of side 1, turned by 45 degrees within one of side 2 sqrt(1/2): all of it.
    turned = Box((0, 0, 0.5), (1, 1, 1), math.pi / 4)
    assert compute_shared_area(turned, Box((0, 0, 0.5), (1.5, 1.5, 1))) == pytest.approx(1.0)


def test_corners_near_by_hand():
    """Corners at x = 1; the other box begins at x = 1.15."""
    box, other = Box((0, 0, 0.5), (2, 1, 1)), Box((1.65, 0, 2.5), (1, 1, 1))
    assert find_corner_near(box, other, 0.2)
    assert not find_corner_near(box, other, 0.1)


def test_turns_are_those_of_boxes():
    rng = np.random.default_rng(0)
    box = Box((1.0, 2.0, 0.5), (2, 1, 1), 0.7)
    own = rng.normal(size=(10, 3))
    assert own @ make_upright_turn(0.7).T + box.center == pytest.approx(box.to_map(own))
    assert (box.to_map(own) - box.center)[:, :2] @ make_turn(0.7) == pytest.approx(own[:, :2])
    many = np.array([0.0, 0.7, -2.0])
    assert make_turn(many)[1] == pytest.approx(make_turn(0.7))
    assert make_upright_turn(many)[2, :2, :2] == pytest.approx(make_turn(-2.0))
    assert make_upright_turn(np.empty(0)).shape == (0, 3, 3)
    x, y = turn_flat(own[:, 0], own[:, 1], 0.7, (3.0, 4.0))
    assert np.column_stack([x, y]) == pytest.approx(own[:, :2] @ make_turn(0.7).T + (3.0, 4.0))

import math

import numpy as np
import pytest

from sgm.layout.box import Box, sample_volume
from sgm.layout.outline import compute_prism_entries, contains_points, read_outline

# Two arms of 2 m x .6 m and .6 m x 2 m that meet at (0, 0): an area of 1.2 + .84 = 2.04 m2.
CORNERS = [(0, 0), (2, 0), (2, 0.6), (0.6, 0.6), (0.6, 2), (0, 2)]
COUNTER = Box.of_polygon(CORNERS, 0.0, 0.9)


def test_a_counter_round_the_corner_by_hand():
    assert COUNTER.center == (1.0, 1.0, 0.45)
    assert COUNTER.size == (2.0, 2.0, 0.9)
    np.testing.assert_allclose(COUNTER.corners, CORNERS)
    points = np.array([[0.3, 1.5, 0.5], [1.6, 1.4, 0.5], [1.6, 0.3, 1.1], [-0.3, 2.4, 0.9]])
    # inside; in the notch, .8 from the upper arm and 1 from the other; .2 above; .3 and .4 beside
    np.testing.assert_allclose(COUNTER.compute_distance(points), [0, 0.8, 0.2, 0.5])
    assert COUNTER.contains(points).tolist() == [True, False, False, False]
    assert COUNTER.contains(points, 0.85).tolist() == [True, True, True, True]
    assert COUNTER.holds(points, 0.0).tolist() == [True, False, False, False]
    assert COUNTER.holds(points, 0.29).tolist() == [True, False, False, False]
    assert COUNTER.holds(points, 0.31).tolist() == [False] * 4  # .3 from the wall


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_it_is_the_same_whatever_its_front(yaw):
    turned = Box.of_polygon(CORNERS, 0.0, 0.9, yaw)
    np.testing.assert_allclose(turned.corners, CORNERS, atol=1e-9)
    points = np.random.default_rng(0).uniform(-1, 3, (200, 3))
    np.testing.assert_allclose(
        turned.compute_distance(points), COUNTER.compute_distance(points), atol=1e-9
    )
    assert Box.of_polygon(CORNERS[::-1], 0.0, 0.9, yaw).corners.shape == (6, 2)  # clockwise


def test_points_fill_the_polygon_alone():
    points = sample_volume(COUNTER, "onTop", 1000)
    assert points.shape == (1000, 3)
    assert COUNTER.on_top.contains(points).all()
    # 1.2 of 2.04 m2 are below y = .6: .588 +- .016, one standard deviation of random points
    assert np.mean(points[:, 1] < 0.6) == pytest.approx(1.2 / 2.04, abs=0.02)


def test_inside_agrees_with_two_rectangles():
    points = np.random.default_rng(1).uniform(-0.5, 2.5, (2000, 2))
    x, y = points.T
    lower = (x > 0) & (x < 2) & (y > 0) & (y < 0.6)
    upper = (x > 0) & (x < 0.6) & (y > 0) & (y < 2)
    outline = read_outline("polygon", CORNERS)
    np.testing.assert_array_equal(contains_points(outline, points), lower | upper)


def test_rays_meet_the_nearer_of_two_boxes():
    """Of the two rectangles that the polygon consists of; rays start outside both."""
    rng = np.random.default_rng(2)
    start = np.array([3.0, 2.5, 1.6])
    targets = rng.uniform((-0.5, -0.5, 0.0), (2.5, 2.5, 1.4), (500, 3))
    along = targets - start
    expected = np.full(500, np.inf)
    for center, size in (((1.0, 0.3, 0.45), (2.0, 0.6, 0.9)), ((0.3, 1.0, 0.45), (0.6, 2.0, 0.9))):
        ends = np.stack(
            [(np.array(center) + s * np.array(size) / 2 - start) / along for s in (-1, 1)]
        )
        enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        expected = np.where(enter <= leave, np.minimum(expected, enter), expected)
    found = compute_prism_entries(COUNTER.outline, 0.45, start - COUNTER.center, along)
    assert 100 < np.isfinite(expected).sum() < 450
    np.testing.assert_allclose(found, expected)


def test_json_and_back():
    assert Box.from_json(COUNTER.to_json()) == COUNTER
    assert len(Box((0, 0, 1), (1, 1, 1)).to_json()) == 8  # as before


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Box.of_polygon([(0, 0), (1, 1)], 0, 1), "polygon must have 3 to 64 corners"),
        (lambda: Box.of_polygon(7, 0, 1), "polygon must have 3 to 64 corners, got 7"),
        (lambda: Box.of_polygon([(0, 0), (1, 1), (2, 2)], 0, 1), "polygon must have an area"),
        (lambda: Box.of_polygon([(0, 0), (1, 1), (1, 0), (0, 1)], 0, 1), "no sides that cross"),
        (lambda: Box.of_polygon([(0, 0), (1, math.nan), (1, 0)], 0, 1), "polygon must be finite"),
        (lambda: Box.of_polygon(CORNERS, 1, 1), "size of a box must be at least"),
        (
            lambda: Box((0, 0, 0), (1, 1, 1), 0, "open", ((0, 0), (0.5, 0), (0, 0.5))),
            "interior of a box with an outline must be none, got 'open'",
        ),
        (
            lambda: Box((0, 0, 0), (1, 1, 1), outline=((0, 0), (2, 0), (0, 0.5))),
            "outline of a box must lie within its size",
        ),
        (
            lambda: Box.of_polygon([(0, 0), (1, 1), (1, 1.001)], 0, 1),
            "outline of a box must fill 1% of it or more",
        ),
    ],
)
def test_bad_polygons_are_one_line(call, message):
    with pytest.raises(ValueError, match=message) as error:
        call()
    assert "\n" not in str(error.value)

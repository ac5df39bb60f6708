import math

import numpy as np
import pytest

from sgm.layout.box import Box, read_box, sample_volume

# A counter .6 m deep and 2 m wide whose front looks along y: own x is y, own y is -x.
COUNTER = Box((1.0, 2.0, 0.45), (0.6, 2.0, 0.9), math.pi / 2, "door")


def test_corners_of_a_turned_box():
    # own (.3, 1) -> (1 - 1, 2 + .3), and so on counter-clockwise
    assert np.allclose(COUNTER.corners, [[0, 2.3], [0, 1.7], [2, 1.7], [2, 2.3]])
    assert (COUNTER.bottom, COUNTER.top) == (0.0, 0.9)
    assert COUNTER.radius == pytest.approx(math.sqrt(0.36 + 4 + 0.81) / 2)


def test_own_axes_and_back():
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert np.allclose(COUNTER.to_map(COUNTER.to_own(points)), points)
    assert np.allclose(COUNTER.to_own(np.array([1.0, 2.3, 0.45])), [0.3, 0, 0])


def test_distances_from_a_turned_box():
    points = np.array([[1, 2, 0.5], [1, 2.7, 0.5], [2.3, 2.7, 0.5], [1, 2, 1.1]])
    # inside; .4 before the front; .3 and .4 beside a corner; .2 above
    assert np.allclose(COUNTER.compute_distance(points), [0, 0.4, 0.5, 0.2])
    assert COUNTER.contains(points, 0.45).tolist() == [True, True, False, True]
    assert COUNTER.contains(points).tolist() == [True, False, False, False]


def test_volumes():
    top, inside = COUNTER.on_top, COUNTER.inside
    assert (top.bottom, top.top) == (pytest.approx(0.87), pytest.approx(1.3))
    assert np.allclose(top.corners, COUNTER.corners)
    assert inside is not None
    assert np.allclose(inside.size, (0.56, 1.96, 0.86))  # 2 cm of walls
    assert Box((0, 0, 0.4), (1, 1, 0.8)).inside is None
    assert Box((0, 0, 0.4), (0.02, 1, 0.8), interior="open").inside.size[0] == 0.01
    assert (COUNTER.volume("in"), COUNTER.volume("onTop")) == (inside, top)


@pytest.mark.parametrize("relation", ["in", "onTop"])
def test_points_fill_the_volume_evenly(relation):
    points = sample_volume(COUNTER, relation, 128)
    volume = COUNTER.volume(relation)
    assert volume.contains(points).all()
    assert (sample_volume(COUNTER, relation, 128) == points).all()
    assert points[:, 2].min() >= (COUNTER.top if relation == "onTop" else volume.bottom)
    for axis in volume.to_own(points).T:  # each quarter of each axis holds a quarter of the points
        counts, _ = np.histogram(axis, bins=4, range=(axis.min(), axis.max()))
        assert abs(counts - 32).max() <= 4


def test_no_points_where_there_is_no_inside():
    assert sample_volume(Box((0, 0, 0.4), (1, 1, 0.8)), "in").shape == (0, 3)


def test_a_floor():
    floor = Box.of_floor((4, 1), (0, 3), height=0.2)
    assert floor.top == pytest.approx(0.2)
    assert floor.size[:2] == (4, 2)
    assert floor.on_top.contains(np.array([[1, 1.5, 0.3]])).all()


def test_json_and_back():
    assert Box.from_json(COUNTER.to_json()) == COUNTER
    with pytest.raises(ValueError, match=r"box must be a list of x, y, z, .*, got \[1, 2\]\. Mend"):
        Box.from_json([1, 2])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"size": (1, 0, 1)}, r"size of a box must be at least 0\.001 m .*, got \(1\.0, 0\.0, 1"),
        ({"size": (1, 1)}, r"size of a box must be finite numbers of shape \(3,\), got \(1, 1\)"),
        ({"center": (0, math.nan, 0)}, r"center of a box must be finite numbers"),
        ({"center": (0, 1e9, 0)}, r"box must lie within 100000 m, got"),
        ({"yaw": "left"}, r"yaw of a box must be finite numbers of shape \(\), got 'left'"),
        ({"interior": "drawer"}, r"interior of a box must be one of none, open, door, got 'drawer"),
    ],
)
def test_bad_boxes(change, message):
    with pytest.raises(ValueError, match=message):
        Box(**{"center": (0, 0, 0), "size": (1, 1, 1), **change})


def test_what_is_no_box():
    assert read_box(None) is None
    with pytest.raises(TypeError, match=r"box must be a Box, got \(1, 2\)\. Write Box"):
        read_box((1, 2))

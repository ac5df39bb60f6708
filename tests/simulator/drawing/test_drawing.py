"""Drawings of homes: where things stand, which colours they have, and what is written."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from sgm.finder.finder import Finder
from sgm.layout.box import Box
from simulator import (
    Bayesian,
    HomeConfig,
    PriorGraph,
    SampledHomes,
    SceneGraphMemory,
    Sighting,
    Streams,
)
from simulator.drawing import FloorPlan, History, draw_belief, draw_history, draw_home
from simulator.igridson.floor_plan import make_plan
from simulator.igridson.layout_file import load_layout


@pytest.fixture
def axes():
    figure, axes = plt.subplots(figsize=(8, 5))
    yield axes
    plt.close(figure)


@pytest.fixture
def memory():
    memory = SceneGraphMemory()
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    fridge = memory.add_furniture("fridge", kitchen, "white fridge")
    memory.add_furniture("counter top", kitchen)
    desk = memory.add_furniture("desk", study)
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.observe(desk, [Sighting("red mug"), Sighting("laptop")])
    memory.step()
    memory.observe(desk, [Sighting("laptop")])
    return memory


def list_boxes(axes):
    """Furniture as (left, bottom, width, height)."""
    patches = [patch for patch in axes.patches if type(patch) is Rectangle]
    return [(*patch.get_xy(), patch.get_width(), patch.get_height()) for patch in patches]


def test_furniture_without_positions_stands_in_rows_by_room():
    plan = FloorPlan.make(["kitchen", "bedroom"], list("abcdef"), np.array([0, 0, 0, 0, 0, 1]))
    # Four in a row, the first row on top; both rooms are as deep as the deeper one. The second
    # room is 4 columns and a gap of .35 to the right.
    assert plan.corner.tolist() == [[0, -1], [1, -1], [2, -1], [3, -1], [0, -2], [4.35, -1]]
    assert plan.room_box.tolist() == [[0, -2, 4, 2], [4.35, -2, 4, 2]]
    assert not plan.has_positions


def test_furniture_with_positions_stands_there():
    at = np.array([(1.0, 4.0), (3.0, 4.0), (6.0, 1.0)])
    plan = FloorPlan.make(["kitchen", "study"], list("abc"), np.array([0, 0, 1]), positions=at)
    # Nearest neighbours by the larger of both differences: 2, 2 and 3; no square is over 1.5.
    assert plan.size == 1.5
    np.testing.assert_allclose(plan.corner + 0.75, at)
    np.testing.assert_allclose(plan.room_box[0], [0.1, 3.1, 3.8, 1.8])  # .6 * 1.5 around


def test_one_place_without_position_means_rows(memory):
    memory.move_furniture(0, position=(1, 1))
    assert not FloorPlan.of_memory(memory).has_positions
    for number in memory.furniture_ids:
        memory.move_furniture(number, position=(number, 2 * number))
    assert FloorPlan.of_memory(memory).has_positions


def test_spots_lie_in_the_box_or_on_it():
    plan = FloorPlan.make(["kitchen"], ["fridge", "sink"], np.array([0, 0]))
    spots = plan.list_spots(np.array([2, 3, 3]))  # one in the sink, two on it
    # The sink's corner is (1, -1); its box reaches from .06 to .94, a spot is a seventh of that.
    half = 0.88 / 14
    np.testing.assert_allclose(spots[0], [1.06 + half, -0.49])
    np.testing.assert_allclose(spots[1], [1.06 + half, -0.36])
    np.testing.assert_allclose(spots[2], [1.06 + 3 * half, -0.36])


@pytest.mark.parametrize("count", [1, 20, 21, 22, 500])
def test_no_two_objects_share_a_spot(count):
    plan = FloorPlan.make(["kitchen"], ["fridge"], np.array([0]))
    places = np.arange(count) % 2
    spots = plan.list_spots(places)
    assert len(np.unique(spots.round(9), axis=0)) == count
    low, high = plan.corner[0], plan.corner[0] + 1
    assert ((spots > low) & (spots < high)).all()


def test_a_hundred_rooms_do_not_overlap():
    plan = FloorPlan.make(
        [f"room {i}" for i in range(100)], ["shelf"] * 777, np.arange(777) * 7 % 100
    )
    box = plan.room_box
    left, bottom = box[:, 0], box[:, 1]
    right, top = left + box[:, 2], bottom + box[:, 3]
    apart = (left[:, None] >= right) | (bottom[:, None] >= top)
    assert (apart | apart.T | np.eye(100, dtype=bool)).all()
    own = plan.corner, plan.room_box[plan.furniture_room]
    assert (own[0] >= own[1][:, :2] - 1e-9).all()
    assert (own[0] + 1 <= own[1][:, :2] + own[1][:, 2:] + 1e-9).all()


def test_a_memory_is_drawn_with_what_it_holds(axes, memory):
    assert draw_home(axes, memory) is axes
    seen, missing = axes.collections
    assert len(seen.get_offsets()) == 2  # milk and laptop
    assert len(missing.get_offsets()) == 1  # the mug was gone at the second look
    assert len(list_boxes(axes)) == 3
    assert {"white fridge", "desk", "kitchen", "study"} <= {text.get_text() for text in axes.texts}
    styles = [patch.get_linestyle() for patch in axes.patches if type(patch) is Rectangle]
    assert styles == ["-", ":", "-"]  # nobody has looked at the counter top


def test_true_homes_are_drawn(axes):
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "test", [3]))
    place = homes.object_place[0]
    draw_home(axes, FloorPlan.of_homes(homes), {"object": (place[place >= 0], {"s": 4})})
    assert len(axes.collections[0].get_offsets()) == 192
    assert len(list_boxes(axes)) == 32


def test_an_empty_memory_is_drawn(axes):
    memory = SceneGraphMemory()
    draw_home(axes, memory)
    memory.add_room("attic")
    draw_home(axes, memory)


def test_belief_is_shaded_and_written(axes, memory):
    ranking = Finder(Bayesian()).rank(memory, "red mug")
    draw_belief(axes, memory, ranking, order=[1, 2], true_places=[2])
    patches = [patch for patch in axes.patches if type(patch) is Rectangle]
    for place in ranking:
        # On the way from white to orange by the square root of the probability.
        share = np.sqrt(place.probability)
        colour = [1 + (part - 1) * share for part in to_rgb("#f07820")]
        node = memory.furniture_ids.index(place.furniture)
        np.testing.assert_allclose(patches[node].get_facecolor()[:3], colour)
    texts = [text.get_text() for text in axes.texts]
    assert f"elsewhere {ranking.elsewhere:.0%}" in texts
    assert f"{ranking[0].probability:.0%}" in texts
    assert {"1", "2"} <= set(texts)
    (way,) = axes.lines
    centre = FloorPlan.of_memory(memory).centre
    np.testing.assert_allclose(way.get_xdata(), centre[[1, 2], 0])


def test_belief_of_an_array(axes, memory):
    draw_belief(axes, memory, np.array([0.25, 0.0, 0.75]))
    texts = {text.get_text() for text in axes.texts}
    assert {"25%", "75%"} <= texts
    assert "0%" not in texts


@pytest.fixture
def history():
    return History(
        description="mug",
        places=("desk", "fridge"),
        hours=np.array([0.0, 1.0, 2.0, 3.0]),
        belief=np.array([[0.5, 0.1], [np.nan, np.nan], [0.0, 1.0], [0.25, 0.5]]),
        truth=np.array([[1, 0], [1, 0], [0, 1], [1, 0]], dtype=bool),
        look_hour=np.array([1.0, 2.0]),
        look_place=np.array([0, 1]),
        is_found=np.array([True, False]),
    )


def test_stays_are_stretches_of_time(history):
    assert history.edges.tolist() == [0, 1, 2, 3, 4]
    assert history.list_stays() == [(0, 0.0, 2.0), (0, 3.0, 4.0), (1, 2.0, 3.0)]


def test_history_is_drawn(axes, history):
    assert draw_history(axes, history) is axes
    assert len(axes.lines) == 3  # the stays
    assert [text.get_text() for text in axes.get_yticklabels()] == ["desk", "fridge"]
    assert axes.get_legend_handles_labels()[1] == [
        "truly there",
        "look that saw it",
        "look that did not",
    ]
    axes.figure.canvas.draw()


def test_a_history_of_nothing_is_drawn(axes):
    none = np.zeros(0)
    draw_history(axes, History("mug", (), np.zeros(1), None, None, none, none, none))


def test_a_grid_home_stands_as_on_its_grid(axes):
    layout = load_layout(None)
    plan = make_plan(layout)
    rows = layout.size[1]
    middle = plan.corner + plan.size / 2
    for piece, (x, y) in zip(layout.furniture, middle, strict=True):
        assert piece.column <= x <= piece.column + piece.width
        assert piece.row <= rows - y <= piece.row + piece.height
    box = plan.room_box[plan.furniture_room]
    assert (middle >= box[:, :2]).all()
    assert (middle <= box[:, :2] + box[:, 2:]).all()
    draw_belief(axes, plan, np.full(len(plan.furniture), 0.02))


def test_furniture_with_boxes_is_to_scale():
    """A table of 2 x 1 m at (3, 2): its corners, and a room that reaches 10 cm beyond them."""
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("table", kitchen, box=Box((3, 2, 0.4), (2, 1, 0.8)), position=(5, 2))
    memory.add_furniture("shelf", memory.add_room("study"), position=(8, 8))
    plan = FloorPlan.of_memory(memory)
    expected = [[4, 2.5], [2, 2.5], [2, 1.5], [4, 1.5]]
    np.testing.assert_allclose(plan.footprints[0], expected)
    assert np.isnan(plan.footprints[1]).all()
    np.testing.assert_allclose(plan.room_box[0], [1.9, 1.4, 2.2, 1.2])
    np.testing.assert_allclose(plan.stands, [[5, 2], [8, 8]])
    np.testing.assert_allclose(plan.corner[0] + plan.size / 2, [3, 2])
    assert FloorPlan.of_memory(SceneGraphMemory()).footprints is None

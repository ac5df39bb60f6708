"""Looks that had a part of the furniture in view, and sightings that may be wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.schema import COUNTERS, NEVER

IGNORE = pytest.mark.filterwarnings("ignore:.* confidences of a look are below")


@pytest.fixture
def memory():
    made = SceneGraphMemory()
    kitchen = made.add_room("kitchen")
    made.add_furniture("fridge", room=kitchen)
    made.add_furniture("table", room=kitchen)
    made.observe(0, [Sighting("milk", "in")])
    return made


def read_edge(memory, row=0):
    edges = memory.batch.edges
    return {name: edges[name][row].item() for name in (*COUNTERS["edges"], "missed", "confidence")}


def look(memory, coverage, seen=()):
    memory.step()
    memory.observe(0, list(seen), coverage)
    return read_edge(memory)


def test_what_was_not_in_view_is_not_counted_as_absent(memory):
    edge = look(memory, 0.25)
    assert edge["missed"] == 0.25
    assert (edge["is_true"], edge["num_observed"], edge["last_observed"]) == (True, 1, 0)
    assert memory.last_seen("milk").is_there
    assert memory.batch.furniture_num_observed[0].tolist() == [1, 0]
    assert memory.batch.furniture_last_observed[0].tolist() == [0, NEVER]


def test_parts_of_looks_add_up_by_hand(memory):
    """Sums 0.25, 0.5, 1.0, 1.5, 2.5: a look is counted at 0.5, 1.5 and 2.5."""
    counted = []
    for coverage in (0.25, 0.25, 0.5, 0.5, 1.0):
        edge = look(memory, coverage)
        counted.append((edge["missed"], edge["is_true"], edge["num_observed"] - 1))
    assert counted == [
        (0.25, True, 0), (0.5, False, 1), (1.0, False, 1), (1.5, False, 2), (2.5, False, 3),
    ]  # fmt: skip
    assert edge["num_changed"] == 1
    assert edge["last_changed"] == 2
    assert edge["last_observed"] == 5
    # Looks of half of the fridge and more are looks at it.
    assert memory.batch.furniture_num_observed[0, 0] == 1 + 3


def test_a_sighting_in_a_part_is_a_sighting(memory):
    look(memory, 0.4)
    edge = look(memory, 0.1, [Sighting("milk", "in")])
    assert (edge["missed"], edge["is_true"], edge["num_true"], edge["last_true"]) == (0, True, 2, 2)
    assert look(memory, 0.4)["is_true"]  # it begins anew


@pytest.mark.slow
@given(st.lists(st.tuples(st.booleans(), st.sampled_from([0.125, 0.25, 0.5, 1.0])), max_size=20))
def test_a_false_edge_has_at_least_half_a_look_against_it(looks):
    memory = SceneGraphMemory()
    memory.add_furniture("fridge", room=memory.add_room("kitchen"))
    memory.observe(0, [Sighting("milk", "in")])
    against, counted = 0.0, 0
    for is_seen, coverage in looks:
        edge = look(memory, coverage, [Sighting("milk", "in")] * is_seen)
        against = 0.0 if is_seen else against + coverage
        counted = 0 if is_seen else int(against + 0.5)
        assert edge["missed"] == against
        assert edge["is_true"] == (against < 0.5)
        assert memory.batch.edges["num_absent"][0] == counted


def test_a_hypothetical_edge_is_false_after_most_of_a_look(memory):
    for coverage, num_edges in ((0.25, 1), (0.5, 2)):
        memory.step()
        memory.query("yoghurt")
        memory.observe(0, [Sighting("milk", "in")], coverage)
        assert memory.batch.edges["num_true"].tolist().count(0) == num_edges - 1
    edge = read_edge(memory, 1)
    assert (edge["is_true"], edge["num_observed"], edge["confidence"]) == (False, 1, 0)
    assert edge["missed"] == 1.5  # the fridge was looked at once before


@IGNORE
def test_confidence_by_hand(memory):
    edge = look(memory, 1.0, [Sighting("milk", "in", confidence=0.75)])
    assert (edge["is_true"], edge["num_true"], edge["confidence"]) == (True, 2, 0.75)
    # A quarter of a sighting is three quarters of a look without the object.
    edge = look(memory, 1.0, [Sighting("milk", "in", confidence=0.25)])
    assert (edge["is_true"], edge["missed"], edge["confidence"]) == (False, 0.75, 0.75)
    assert memory.batch.objects["last_observed"][0] == 1
    # Of several sightings of one thing the surest counts.
    twice = [Sighting("milk", "in", confidence=share) for share in (0.5, 0.25)]
    edge = look(memory, 1.0, twice)
    assert (edge["is_true"], edge["confidence"], edge["missed"]) == (True, 0.5, 0)


@IGNORE
def test_a_doubtful_sighting_makes_no_edge(memory):
    look(memory, 1.0, [Sighting("cup", confidence=0.4)])
    assert memory.places_of("cup") == []
    assert memory.batch.edges.num_rows == 1


def test_partial_looks_survive_a_file(memory, tmp_path):
    look(memory, 0.25, [Sighting("cup", confidence=0.75)])
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for row in range(2):
        assert read_edge(copy, row) == read_edge(memory, row)
    assert look(copy, 0.25) == look(memory, 0.25)
    assert not read_edge(copy)["is_true"]


@pytest.mark.parametrize("coverage", [0, -0.5, 1.5, float("nan")])
def test_bad_coverage_is_refused(memory, coverage):
    with pytest.raises(
        ValueError, match=r"coverage must be above 0 and at most 1, got .* at fridge in kitchen\. G"
    ):
        memory.observe(0, [], coverage)


def test_bad_confidence_is_refused():
    with pytest.raises(
        ValueError, match=r"confidence must lie in \[0, 1\], got 2 for 'cup'\. Give"
    ):
        Sighting("cup", confidence=2)


def test_a_change_says_what_was_seen_and_how_much_was_in_view(memory):
    batch = memory.batch
    change = batch.observe(
        np.zeros(1, int), np.zeros(1, int), np.zeros(0, int), np.zeros(0, int), np.array([0.25])
    )
    assert change.edges.tolist() == [0]
    assert change.is_seen.tolist() == [False]  # although the edge is still true
    assert change.coverage.tolist() == [0.25]

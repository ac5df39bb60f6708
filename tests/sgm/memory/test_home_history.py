"""What a memory counts of a home, worked by hand."""

import json
import math
from datetime import datetime

import numpy as np
import pytest

from sgm.arrays.week import HOUR_SECONDS
from sgm.evidence.question import HomeSums
from sgm.memory.clock import Clock
from sgm.memory.home_history import MOST_FURNITURE
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian
from sgm.schema import NUM_LOOKS_KEPT
from simulator import SceneGraphMemory, Sighting
from simulator.tasks.rollout import Rollout

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
MUG = 0
EDGE_HISTORY = ("num_absent", "time_true")
ASK = tuple(np.array([value]) for value in (0, 7, 11, MUG))


def look(memory, furniture, is_seen):
    """One step, in which home 0 looks and sees its mug or not."""
    memory.step()
    rows = memory.ensure_objects(*ASK)[:is_seen]
    memory.observe(np.array([0]), np.array([furniture]), rows, np.ones(len(rows), dtype=int))


@pytest.fixture
def memory(make_tiny_memory):
    """The mug is seen on the table at 1 and 3, missed at 2, seen on the bed at 4."""
    memory = make_tiny_memory(2)
    for furniture, is_seen in ((TABLE, True), (TABLE, False), (TABLE, True), (BED, True)):
        look(memory, furniture, is_seen)
    return memory


def test_moves_and_the_time_between_sightings(memory):
    moves = np.zeros((2, 6, 6), dtype=int)
    moves[0, TABLE, BED] = 1
    np.testing.assert_array_equal(memory.history.moves, moves)
    counters = memory.history.counters
    assert counters["num_moved"].tolist() == [1, 0]
    assert counters["time_followed"].tolist() == [2 + 1, 0]  # from 1 to 3, from 3 to 4
    assert memory.objects["first_observed"].tolist() == [1]
    assert memory.history.compute_move_rate().tolist() == [1.5 / 18, 0.5 / 15]


def test_is_counted_for_those_who_ask(make_tiny_homes):
    memory = Rollout(make_tiny_homes(2), Adaptive()).memory
    assert memory.history.counters["num_asked"].tolist() == [0, 0]
    rollout = Rollout(make_tiny_homes(2), Bayesian())
    assert not rollout.memory.counts_history
    with pytest.raises(ValueError, match=r"does not count it. Call `count_history` before"):
        _ = rollout.memory.history
    rollout.ask()
    rollout.look(np.array([0, 1]))
    with pytest.raises(ValueError, match=r"from the first look on, got a memory of 2 looks"):
        rollout.memory.count_history()


def test_a_look_that_missed_what_is_found_there_again(memory):
    """At 3: followed for 2 steps, no move yet, so it stayed with exp(-2 x 0.5 / 17)."""
    stayed = math.exp(-1 / 17)
    assert memory.history.counters["num_missed"].tolist() == pytest.approx([stayed, 0])
    assert memory.history.counters["num_refound"].tolist() == pytest.approx([stayed, 0])
    expected = [(stayed + 2) / (2 * stayed + 10), 0.2]
    assert memory.history.compute_miss_rate().tolist() == pytest.approx(expected)


def test_looks_since_it_was_last_there(memory):
    assert memory.edges["num_absent"].tolist() == [0, 0]  # table, bed
    for _ in range(2):
        look(memory, TABLE, False)
    assert memory.edges["num_absent"].tolist() == [2, 0]
    memory.step()
    memory.query(*ASK)
    for _ in range(2):  # in one step: the second look finds the hypothetical edge remembered
        memory.observe(
            np.array([0]), np.array([SHELF]), np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        )
    assert memory.edges["num_absent"].tolist() == [2, 0, 2]


def test_time_at_a_place(memory):
    """On the table it was seen at 1 and gone at 2, seen at 3; then the looks are elsewhere."""
    assert memory.edges["time_true"].tolist() == [1, 0]
    for _ in range(3):  # at 5, 6 and 7; at the last it is gone from the bed
        look(memory, BED, memory.time < 6)
    assert memory.edges["time_true"].tolist() == [1, 3]
    look(memory, TABLE, False)
    assert memory.edges["time_true"].tolist() == [1 + 5, 3]
    assert HomeSums.of(memory, memory.history).num_left.tolist() == [2 + 1, 0]


def test_whether_it_still_is_where_it_was_last_seen(memory):
    """Only looks at the bed, while the mug is asked for, say that."""
    look(memory, BED, True)
    for furniture, is_seen in ((BED, True), (BED, False), (TABLE, True), (TABLE, False)):
        memory.step()
        rows = memory.query(*ASK).object[: int(is_seen)]
        memory.observe(np.array([0]), np.array([furniture]), rows, np.ones(len(rows), dtype=int))
    assert memory.objects["num_sought"].tolist() == [3]
    assert memory.objects["num_still"].tolist() == [1]


def test_a_home_that_does_not_look_seeks_nothing(make_tiny_memory):
    """Nobody has seen the mug of either home; it is asked for in both, and the first one looks."""
    memory = make_tiny_memory(2)
    memory.step()
    both = np.array([0, 1])
    memory.query(both, *(np.repeat(part, 2) for part in ASK[1:]))
    none = np.zeros(0, dtype=int)
    memory.observe(np.array([0]), np.array([TABLE]), none, none)
    assert memory.objects["num_sought"].tolist() == [0, 0]


def test_which_rule_would_have_found_it(memory):
    """Sightings per look: table 2 / 3.5, bed 1 / 1.5, so the bed, which is also the last place.

    The prior has the mug on the kitchen's table or shelf.
    """
    memory.step()
    memory.query(*ASK)
    rows = memory.ensure_objects(*ASK)
    memory.observe(np.array([0]), np.array([BED]), rows, np.array([1]))
    names = ("num_asked", "num_found", "num_last_right", "num_common_right", "num_prior_right")
    assert [memory.history.counters[name][0] for name in names] == [1, 1, 1, 1, 0]


def test_only_the_latest_looks_are_kept(memory):
    assert sorted(memory.history.look_times[0, TABLE].tolist())[-3:] == [1, 2, 3]
    for _ in range(NUM_LOOKS_KEPT + 3):
        look(memory, TABLE, False)
    assert sorted(memory.history.look_times[0, TABLE].tolist()) == list(range(8, 16))
    assert (memory.history.look_times[1] == -1).all()


@pytest.fixture
def lived_in():
    """A home with a clock whose steps are half an hour from 07:00 on, and furniture removed."""
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 16, 7), 1800.0))
    kitchen = memory.add_room("kitchen")
    shelf, table, sink = (memory.add_furniture(x, kitchen) for x in ("shelf", "table", "sink"))
    for turn in range(20):
        memory.query("mug")
        memory.observe(
            (shelf, table, sink)[turn % 3], [Sighting("mug"), Sighting("cup")][: turn % 4]
        )
        memory.step()
    memory.remove_furniture(shelf)
    memory.observe(sink, [Sighting("mug"), Sighting("plate")])
    return memory


def test_sightings_by_hour_of_day(lived_in):
    batch = lived_in.batch
    hours, gone = batch.history.get_edge_hours(np.arange(batch.edges.num_rows))
    assert (gone.sum(axis=1) <= batch.edges["num_observed"] - batch.edges["num_true"]).all()
    assert hours.sum(axis=1).tolist() == batch.edges["num_true"].tolist()
    # The last look is at 07:00 + 20 x 0.5 h = 17:00, in the bin from 16 to 18.
    assert hours[batch.edges["last_true"] == 20][:, 8].tolist() == [1, 1]


def test_looks_that_find_it_gone_by_hour_of_day(make_tiny_memory):
    memory = make_tiny_memory(1)
    memory.clock = np.array([[0, 2 * HOUR_SECONDS]])
    for is_seen in (False, True, False, True, True, False, False):  # from two o'clock on
        look(memory, TABLE, is_seen)
    seen, gone = memory.history.get_edge_hours(np.arange(1))[:, 0]
    assert np.flatnonzero(seen).tolist() == [2, 4, 5]
    assert np.flatnonzero(gone).tolist() == [3, 6, 7]


def test_is_saved_and_goes_on(lived_in, tmp_path):
    lived_in.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for one in (lived_in, copy):
        one.step(3)
        one.query("cup")
        one.observe(one.furniture_ids[0], [Sighting("cup")])
    mine, theirs = lived_in.batch.history.to_json(), copy.batch.history.to_json()
    assert json.dumps(mine) == json.dumps(theirs)
    for table in ("objects", "edges"):
        for name in lived_in.batch.objects if table == "objects" else EDGE_HISTORY:
            column = getattr(lived_in.batch, table)[name]
            assert column.tolist() == getattr(copy.batch, table)[name].tolist()


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("look_times", [[0] * NUM_LOOKS_KEPT], "shape"),
        ("look_times", [[10**6] * NUM_LOOKS_KEPT] * 2, "must lie in -1 to 20"),
        ("moves", [[2], [0], [1]], "moves must lie in 0 to 1, got 2"),
        ("moves", [[0], [1]], "whole numbers: rows, columns and counts"),
        ("edge_hours", [[0], [12], [1]], "edge_hours must lie in 0 to 11, got 12"),
        ("edge_hours", [[0], [0], [0.5]], "whole numbers"),
    ],
)
def test_counts_that_do_not_fit_are_refused(lived_in, part, value, message):
    content = lived_in._state.get_content()
    data = content.to_json()
    data["history"][part] = value
    with pytest.raises(ValueError, match=message):
        type(content).from_json(data)


def test_a_home_of_much_furniture_takes_no_square_of_it(tmp_path):
    """Moves among 5,000 places would be 100 MB, copied whenever somebody asks."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    ids = [memory.add_furniture("shelf", room) for _ in range(MOST_FURNITURE)]
    for turn, number in enumerate((ids[0], ids[1])):
        memory.observe(number, [Sighting("mug")])
        memory.step()
        assert memory.batch.history.moves.sum() == turn
    assert memory.batch.history.counts_moves
    more = memory.add_furniture("shelf", room)
    memory.observe(more, [Sighting("mug")])
    history = memory.batch.history
    assert not history.counts_moves
    assert history.moves.shape == (1, MOST_FURNITURE + 1, MOST_FURNITURE + 1)
    assert history.moves.base is None or history.moves.strides == (0, 0, 0)
    assert history.counters["num_moved"][0] == 2
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert copy.batch.history.to_json() == history.to_json()
    memory.remove_furniture(more)
    assert memory.batch.history.counts_moves
    assert memory.rank(Adaptive(), "mug")[0][0] in ids

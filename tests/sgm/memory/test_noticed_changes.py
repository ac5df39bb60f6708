"""What has changed since a time, and what is known of one thing, in small sessions by hand."""

import math
from datetime import datetime

import pytest

from simulator import Clock, SceneGraphMemory, Sighting

FRIDGE, TABLE, SHELF = range(3)


@pytest.fixture
def memory():
    """A cup and a plate on the table at 0, nothing in the fridge; it is 4."""
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20, 8)))
    room = memory.add_room("kitchen")
    for label in ("fridge", "table", "shelf"):
        memory.add_furniture(label, room)
    memory.observe(TABLE, [Sighting("cup"), Sighting("plate")])
    memory.observe(FRIDGE, [])
    memory.step(4)
    return memory


def tell(changes):
    return [
        (change.kind, change.thing, change.from_place, change.to_place, change.after, change.time)
        for change in changes
    ]


def test_new_moved_and_gone(memory):
    memory.observe(FRIDGE, [Sighting("milk", "in", 0.75), Sighting("cup", "in")])
    memory.step(2)
    assert tell(memory.changes(1)) == [
        ("moved", "cup", TABLE, FRIDGE, 0, 4),
        ("new", "milk", None, FRIDGE, 0, 4),
    ]
    assert [change.probability for change in memory.changes(1)] == [1, 0.75]
    memory.observe(TABLE, [])
    assert tell(memory.changes(5)) == [("gone", "plate", TABLE, None, 0, 6)]
    assert memory.changes(7) == []
    everything = memory.changes(0)
    assert [change.time for change in everything] == sorted(
        (change.time for change in everything), reverse=True
    )
    assert {(c.kind, c.thing) for c in everything} == {
        ("new", "cup"),
        ("new", "plate"),
        ("new", "milk"),
        ("moved", "cup"),
        ("gone", "plate"),
    }


@pytest.mark.parametrize(("sightings", "place", "after"), [(1, FRIDGE, 0), (2, None, None)])
def test_what_is_new_came_to_its_first_place_or_to_none_that_is_kept(
    memory, sightings, place, after
):
    """Of a place the last sighting is kept: it was the first one, or says nothing of that."""
    memory.observe(SHELF, [])
    memory.step()
    for _ in range(sightings):
        memory.observe(FRIDGE, [Sighting("milk", "in")])
        memory.step()
    last, now = memory.time - 1, memory.time
    memory.observe(SHELF, [Sighting("milk")])
    memory.observe(FRIDGE, [])
    new, moved = sorted(memory.changes(5), key=lambda change: change.time)
    assert tell([new]) == [("new", "milk", None, place, after, 5)]
    assert tell([moved]) == [("moved", "milk", FRIDGE, SHELF, last, now)]


def test_how_sure_it_is_that_something_is_gone(memory):
    """Looks of two steps miss the cup: it stayed with exp(-6 r) and was missed with m^2."""
    memory.step(2)
    memory.observe(TABLE, [Sighting("plate")])
    (once,) = memory.changes(1)
    memory.observe(TABLE, [Sighting("plate")])  # looks of one step err alike
    assert memory.changes(1) == [once]
    memory.step()
    memory.observe(TABLE, [Sighting("plate")])
    (twice,) = memory.changes(1)
    history = memory.batch.history
    rate, miss = history.compute_move_rate()[0], history.compute_miss_rate()[0]
    left = 1 - math.exp(-6 * rate)
    stayed = math.exp(-6 * rate) * miss**2
    assert twice.probability == pytest.approx(left / (left + stayed))
    assert once.probability < twice.probability < 1


def test_a_part_of_a_look_makes_nothing_gone(memory):
    memory.observe(TABLE, [], coverage=0.4)
    assert memory.changes(1) == []


def test_what_was_said_and_done(memory):
    memory.note_moved("cup", SHELF, by="anna", confidence=0.75)
    memory.step()
    (change,) = memory.changes(1)
    assert tell([change]) == [("moved", "cup", TABLE, SHELF, 0, 4)]
    assert (change.by, change.probability) == ("anna", 0.75)
    memory.picked_up("plate")
    memory.step()
    change = memory.changes(5)[0]
    assert tell([change]) == [("picked_up", "plate", TABLE, None, 0, 5)]
    assert (change.by, change.probability) == ("robot", 0.97)
    memory.put_down("plate", FRIDGE, "in")
    (change,) = memory.changes(6)
    assert tell([change]) == [("moved", "plate", TABLE, FRIDGE, 0, 6)]
    assert change.by == "robot"


def test_what_came_back_is_not_gone(memory):
    memory.observe(TABLE, [Sighting("plate")])
    memory.step()
    memory.observe(TABLE, [Sighting("plate"), Sighting("cup")])
    assert memory.changes(1) == []


def test_of_several_of_a_kind_each_place_counts(memory):
    memory.observe(SHELF, [Sighting("fork"), Sighting("fork")])
    memory.observe(TABLE, [Sighting("fork"), Sighting("cup"), Sighting("plate")])
    memory.step()
    memory.observe(SHELF, [])
    assert tell(memory.changes(5)) == [("gone", "fork", SHELF, None, 4, 5)]


def test_since_a_date(memory):
    memory.observe(FRIDGE, [Sighting("milk", "in")])  # at 12
    assert tell(memory.changes(datetime(2026, 11, 20, 11, 30)))[0][1] == "milk"
    assert memory.changes(datetime(2026, 11, 20, 13)) == []
    with pytest.raises(ValueError, match=r"since must be a time step or, with a clock, a local"):
        memory.changes("yesterday")
    with pytest.raises(ValueError, match=r"since must be a time step"):
        SceneGraphMemory().changes(datetime(2026, 11, 20))


def test_the_history_of_a_thing(memory):
    memory.note_moved("cup", SHELF, by="anna")
    memory.step()
    memory.observe(SHELF, [])
    memory.step()
    memory.observe(FRIDGE, [Sighting("cup", "in", 0.75)])
    told = [(event.time, event.kind, event.furniture, event.by) for event in memory.history("cup")]
    assert told == [
        (6, "seen", FRIDGE, ""),
        (5, "missed", SHELF, ""),
        (4, "moved", SHELF, "anna"),
        (0, "seen", TABLE, ""),
    ]
    assert memory.history("the cup")[0].confidence == 0.75
    assert memory.history("unicorn") == []
    memory.remove_furniture(FRIDGE)
    assert memory.history("cup")[0].furniture is None


def test_what_was_taken_elsewhere_within_one_step(memory):
    memory.note_moved("cup", FRIDGE, by="anna")
    memory.picked_up("cup")
    memory.put_down("cup", SHELF)
    assert [event.kind for event in memory.history("cup")] == [
        "put_down",
        "picked_up",
        "moved",
        "seen",
    ]
    last = memory.last_seen("cup")
    assert (last.furniture, last.is_there, last.by) == (SHELF, True, "robot")
    memory.observe(SHELF, [])  # it has gone from the shelf, not from the fridge
    assert ("gone", "cup", SHELF, None, 4, 4) in tell(memory.changes(4))
    assert memory.last_seen("cup").furniture == SHELF

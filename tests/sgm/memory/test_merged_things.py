"""Things that are called otherwise, are one, or are two; and what undoes it."""

from dataclasses import replace

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_event import read_events
from sgm.memory.merged_things import find_roots
from sgm.memory.thing import Thing, ThingRows
from sgm.replay.replay import replay
from simulator import Bayesian, SceneGraphMemory, Sighting
from tests.sgm.memory.sessions import dump

FINDER = Finder(Bayesian())
SINK, DESK, SHELF = range(3)


@pytest.fixture
def memory(tmp_path):
    """A torch at the sink at 0, a lamp on the desk at 1, not shown by a look at 2."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    for label in ("sink", "desk", "shelf"):
        memory.add_furniture(label, room)
    memory.observe(SINK, [Sighting("torch"), Sighting("spoon")])
    memory.step()
    memory.observe(DESK, [Sighting("night lamp")])
    memory.step()
    memory.observe(DESK, [])
    memory.step()
    return memory


def list_seen(memory, thing):
    return {
        (seen.furniture, seen.time, seen.is_there, seen.times_seen, seen.times_looked)
        for seen in memory.places_of(thing)
    }


def list_probabilities(memory, thing):
    ranking = FINDER.rank(memory, thing)
    found = {place.furniture: place.probability for place in ranking}
    assert sum(found.values()) + ranking.elsewhere == pytest.approx(1)
    return found


def test_a_thing_is_called_otherwise(memory):
    before = list_seen(memory, "torch")
    memory.rename("torch", "flashlight", by="anna")
    assert memory.descriptions == ("flashlight", "spoon", "night lamp")
    assert list_seen(memory, "flashlight") == before
    memory.observe(SHELF, [Sighting("flashlight")])
    assert memory.last_seen("the flashlight").furniture == SHELF
    memory.observe(SINK, [])  # and what misses it is about the same thing
    assert (SINK, 0, False, 1, 2) in list_seen(memory, "flashlight")


def test_a_thing_that_is_called_otherwise_is_of_another_type(memory):
    """It is as if all were looked up again, and nothing of the others is."""
    memory.query("torch")
    prior = memory.batch.place_prior
    memory.rename("torch", "milk")
    again = memory.copy()
    assert memory.batch.place_prior is prior
    assert memory.batch.labels == again.batch.labels
    for table in ("objects", "edges"):
        for name, values in getattr(again.batch, table).items():
            np.testing.assert_array_equal(getattr(memory.batch, table)[name], values, name)
    for one in (memory, again):
        one.observe(SHELF, [])  # no longer asked for: no edge is opened
        one.observe(SINK, [Sighting("milk"), Sighting("torch")])
    assert dump(memory) == dump(again)
    assert list_probabilities(memory, "milk") == list_probabilities(again, "milk")


@pytest.mark.parametrize("ids", [("", "", ""), ("", "7", "8")])
def test_a_list_of_things_is_after_a_rename_as_if_made_anew(ids):
    names = ("red mug", "spoon", "spoon" if ids[2] else "torch")
    things = [Thing(*pair) for pair in zip(names, ids, strict=True)]
    rows = ThingRows(things)
    assert len(set(rows.number_descriptions().tolist())) == len(set(names))
    for row, name in ((0, "Red_Mug"), (1, "ladle"), (0, "mug")):
        rows.rename(row, name)
        things[row] = replace(things[row], description=name)
        anew = ThingRows(things)
        assert rows.names == anew.names
        assert rows.descriptions == anew.descriptions
        assert rows.number_descriptions().tolist() == anew.number_descriptions().tolist()
        for part in ("_things", "_rows", "_rows_with_id", "_texts", "_read"):
            assert getattr(rows, part) == getattr(anew, part), part
    assert rows.find_rows("spoon") == ([2] if ids[2] else [])


def test_two_names_are_one_thing(memory):
    memory.merge("torch", "night lamp", by="anna")
    both = {(SINK, 0, False, 1, 1), (DESK, 1, False, 1, 2)}  # it was on the desk after that
    assert list_seen(memory, "torch") == list_seen(memory, "night lamp") == both
    assert list_probabilities(memory, "torch") == list_probabilities(memory, "night lamp")
    (sink, desk) = (memory.to_dict()["rooms"][0]["furniture"][n]["objects"] for n in (SINK, DESK))
    assert [row["description"] for row in sink] == ["torch", "spoon"]
    assert [row["description"] for row in desk] == ["torch"]


def test_looks_at_one_place_are_not_counted_twice(memory):
    """Three looks at the desk: one shows the lamp, one neither, one the torch."""
    memory.observe(DESK, [Sighting("torch")])
    memory.merge("torch", "night lamp")
    desk = next(seen for seen in list_seen(memory, "torch") if seen[0] == DESK)
    assert desk == (DESK, 3, True, 2, 3)


def test_looks_under_either_name_are_about_both(memory):
    memory.merge("torch", "night lamp")
    memory.observe(SHELF, [Sighting("night lamp")])
    assert memory.last_seen("torch").furniture == SHELF
    assert list_probabilities(memory, "torch")[SHELF] > 0.9
    memory.step()
    memory.observe(SHELF, [Sighting("torch")])
    assert (SHELF, 4, True, 2, 2) in list_seen(memory, "night lamp")


def test_a_look_that_shows_one_name_does_not_miss_the_other(memory):
    memory.merge("torch", "night lamp")
    memory.observe(SINK, [Sighting("night lamp")])
    assert list_probabilities(memory, "torch")[SINK] > 0.9


def test_what_is_said_is_of_the_one_thing(memory):
    memory.note_moved("night lamp", SHELF, by="anna")
    memory.merge("torch", "night lamp")
    assert memory.last_seen("torch").by == "anna"
    memory.note_moved("night lamp", DESK, by="tom")  # where either name was is where it is no more
    there = {seen.furniture for seen in memory.places_of("torch") if seen.is_there}
    assert there == {DESK}
    assert [event.by for event in memory.history("torch") if event.kind == "moved"] == [
        "tom",
        "anna",
    ]
    assert {change.thing for change in memory.changes(0)} == {"torch", "spoon"}


def test_a_merge_is_undone_to_the_bit(memory):
    before = dump(memory)
    memory.merge("torch", "night lamp")
    assert dump(memory) != before
    memory.split("night lamp")
    assert dump(memory) == before
    memory.merge("torch", "night lamp")
    memory.split("torch")  # or by the name that stands for both
    assert dump(memory) == before


def test_chains_of_merges(memory):
    memory.merge("torch", "night lamp")
    memory.merge("spoon", "torch")  # whatever was one with it comes along
    assert list_seen(memory, "night lamp") == list_seen(memory, "spoon")
    memory.forget("spoon")
    assert memory.descriptions == ()
    assert find_roots(np.array([-1, 0, 1, -1])).tolist() == [0, 0, 0, 3]


def test_ids_are_merged_when_a_tracker_lost_one(memory):
    memory.observe(SINK, [Sighting("mug", id="m1")])
    memory.step()
    memory.observe(SHELF, [Sighting("mug", id="m7")])
    memory.merge("m1", "m7")
    assert list_seen(memory, "m1") == list_seen(memory, "m7") == list_seen(memory, "mug")
    memory.picked_up("m7")
    assert FINDER.rank(memory, "m1").with_robot == 0.97
    assert len(memory.carried) == 1
    memory.put_down("m1", DESK)
    assert {seen.furniture for seen in memory.places_of("mug") if seen.is_there} == {DESK}


def test_what_words_did_not_tell_apart_is_two(memory):
    memory.observe(SINK, [Sighting("mug")])
    memory.observe(SHELF, [Sighting("mug")])
    before = list_seen(memory, "mug")
    memory.split("mug", SHELF, "anna's mug", by="anna")
    assert {seen[0] for seen in list_seen(memory, "anna's mug")} == {SHELF}
    own = {seen.furniture for seen in memory.ask(["mug"]).sightings}
    assert own == {SINK}
    memory.merge("mug", "anna's mug")  # and undone
    assert list_seen(memory, "anna's mug") == before


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m: m.rename("unicorn", "horse"), KeyError, "one that was seen or asked for, got"),
        (
            lambda m: m.rename("torch", "Spoon"),
            ValueError,
            "must be of no other thing, got 'Spoon'",
        ),
        (lambda m: m.rename("torch", ""), ValueError, "name must be a non-empty text"),
        (lambda m: m.merge("torch", "unicorn"), KeyError, "got 'unicorn'; there are 3"),
        (lambda m: m.merge("torch", "the torch"), ValueError, "two things must be two"),
        (lambda m: m.split("torch"), ValueError, "must have been merged to be split, got 'torch'"),
        (lambda m: m.split("torch", SINK, "x"), ValueError, "seen there and elsewhere to be split"),
        (lambda m: m.split("torch", 9, "x"), KeyError, "furniture must be an id"),
        (lambda m: m.merge("torch", "spoon", by=""), ValueError, "by must be a non-empty text"),
    ],
)
def test_bad_calls_change_nothing(memory, call, error, message):
    before = dump(memory)
    with pytest.raises(error, match=message):
        call(memory)
    assert dump(memory) == before


def test_what_is_carried_is_put_down_first(memory):
    memory.picked_up("spoon")
    with pytest.raises(ValueError, match="and not carried, to be merged"):
        memory.merge("torch", "spoon")


def test_all_of_it_is_logged_and_saved(memory, tmp_path):
    memory.rename("spoon", "ladle")
    memory.merge("torch", "night lamp", by="anna")
    memory.observe(SHELF, [Sighting("night lamp"), Sighting("mug")])
    memory.observe(SINK, [Sighting("mug")])
    memory.split("mug", SHELF, "anna's mug")
    memory.note_moved("night lamp", DESK, by="anna")
    memory.step()
    memory.save(tmp_path / "home.sgm")
    *_, (again, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    loaded = SceneGraphMemory.load(tmp_path / "home.sgm")
    for one in (memory, again, loaded):
        one.split("torch")
        one.remove_object("torch")
    assert dump(again) == dump(loaded) == dump(memory)

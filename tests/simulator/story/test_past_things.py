"""A thing of a log over its names, and what was said instead of seen."""

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_event import read_events
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.story.past_memory import PastMemory, StillMemory

DRAWER, SHELF, TABLE = range(3)


@pytest.fixture
def log(tmp_path):
    return tmp_path / "looks.sgm"


@pytest.fixture
def memory(log):
    memory = SceneGraphMemory(path=log)
    kitchen = memory.add_room("kitchen")
    for label in ("drawer", "shelf", "table"):
        memory.add_furniture(label, kitchen)
    return memory


def list_found(story, thing):
    """Each look at which the history shows the thing, or misses it: step, place, found."""
    history = story.trace_object(thing)
    places = [history.places[place].split()[0] for place in history.look_place]
    return list(zip(history.look_hour.tolist(), places, history.is_found.tolist(), strict=True))


def test_a_thing_has_its_sightings_under_all_its_names(memory, log):
    """They were "looks that did not" of the new name."""
    memory.observe(TABLE, [Sighting("keys")])
    memory.step()
    memory.observe(TABLE, [Sighting("keys"), Sighting("mug")])
    memory.rename("keys", "gadget", "anna")
    memory.observe(TABLE, [Sighting("gadget")])
    memory.step()
    memory.rename("gadget", "whatnot", "anna")
    memory.observe(SHELF, [Sighting("whatnot"), Sighting("keys")])  # others are called keys now
    story = PastMemory(read_events(log), "home")
    found = [(0, "table", True), (1, "table", True), (1, "table", True), (2, "shelf", True)]
    assert list_found(story, "whatnot") == found
    own = [(found, step) for step, place, found in list_found(story, "keys") if place == "shelf"]
    assert own == [(True, 2)]
    assert not any(found for _, place, found in list_found(story, "keys") if place == "table")


def test_the_belief_is_about_the_thing_under_the_name_it_had(memory, log):
    memory.observe(TABLE, [Sighting("gizmo")])
    memory.step(2)
    memory.rename("gizmo", "whatnot", "anna")
    memory.step()
    finder = Finder(Bayesian())
    history = PastMemory(read_events(log), "home").trace_object("whatnot", finder, num_points=4)
    table = history.places.index("table in kitchen")
    asked = [PastMemory(read_events(log), "home").memory_at(step) for step in range(4)]
    names = ("gizmo", "gizmo", "whatnot", "whatnot")
    expected = [
        next(p.probability for p in finder.rank(memory, name) if p.furniture == TABLE)
        for memory, name in zip(asked, names, strict=True)
    ]
    assert history.belief[:, table].tolist() == expected
    assert min(expected[:2]) > 0.5


def test_merged_things_are_one_and_split_ones_are_not(memory, log):
    memory.observe(TABLE, [Sighting("lamp")])
    memory.observe(SHELF, [Sighting("book")])
    memory.merge("book", "lamp", "anna")
    memory.step()
    both = [(0, "table", True), (0, "shelf", True)]
    assert sorted(list_found(PastMemory(read_events(log), "home"), "book")) == sorted(both)
    memory.split("book")
    one = [row for row in list_found(PastMemory(read_events(log), "home"), "book") if row[2]]
    assert one == [(0, "shelf", True)]


def test_what_was_split_off_takes_its_sightings_along(memory, log):
    memory.observe(TABLE, [Sighting("mug")])
    memory.observe(SHELF, [Sighting("mug")])
    memory.step()
    memory.split("mug", SHELF, "vase", "anna")
    memory.observe(SHELF, [Sighting("vase")])
    story = PastMemory(read_events(log), "home")
    assert [row for row in list_found(story, "vase") if row[2]] == [
        (0, "shelf", True),
        (1, "shelf", True),
    ]
    own = [(step, place) for step, place, found in list_found(story, "mug") if found]
    assert (0, "table") in own
    assert (0, "shelf") not in own


def test_ids_hold_whatever_a_thing_is_called(memory, log):
    memory.observe(TABLE, [Sighting("mug", id="m1"), Sighting("mug", id="m2")])
    memory.step()
    memory.rename("m1", "tea mug", "anna")
    memory.observe(SHELF, [Sighting("cup", id="m1")])
    found = [(0, "table", True), (1, "shelf", True)]
    assert list_found(PastMemory(read_events(log), "home"), "tea mug") == found


def test_a_memory_that_goes_on_knows_its_names_and_what_is_one(memory, log):
    memory.observe(TABLE, [Sighting("keys")])
    memory.observe(SHELF, [Sighting("key ring")])
    memory.rename("keys", "car keys", "anna")
    memory.merge("car keys", "key ring", "anna")
    again = SceneGraphMemory.open(log)
    again.step()
    again.observe(DRAWER, [Sighting("car keys")])
    found = [(0, "table", True), (0, "shelf", True), (1, "drawer", True)]
    assert sorted(list_found(PastMemory(read_events(log), "home"), "car keys")) == sorted(found)


def say_much(memory):
    memory.observe(TABLE, [Sighting("keys"), Sighting("mug")])
    memory.step()
    memory.note_moved("keys", SHELF, "anna")
    memory.rename("keys", "car keys", "anna")
    memory.picked_up("mug")
    memory.put_down("mug", DRAWER)
    memory.step()
    memory.observe(SHELF, [Sighting("car keys"), Sighting("cup")])
    memory.merge("cup", "mug", "tom")
    memory.split("cup", by="tom")
    memory.forget("cup", "tom")
    memory.forget(TABLE, "tom")


def test_who_said_what_is_in_the_story(memory, log):
    say_much(memory)
    story = PastMemory(read_events(log), "home")
    told = [
        (s.step, s.num_looks, s.kind, s.thing, s.by, s.place, s.other) for s in story.statements
    ]
    shelf, drawer, table = (f"{name} in kitchen" for name in ("shelf", "drawer", "table"))
    assert told == [
        (1, 1, "moved", "keys", "anna", shelf, ""),
        (1, 1, "rename", "keys", "anna", "", "car keys"),
        (1, 1, "picked_up", "mug", "robot", "", ""),
        (1, 1, "put_down", "mug", "robot", drawer, ""),
        (2, 2, "merge", "cup", "tom", "", "mug"),
        (2, 2, "split", "cup", "tom", "", ""),
        (2, 2, "remove_object", "cup", "tom", "", ""),
        (2, 2, "remove_furniture", "", "tom", table, ""),
    ]
    history = story.trace_object("car keys")
    places = [history.places[place] for place in history.said_place]
    assert (history.said_hour.tolist(), places, history.said_by) == ([1.0], [shelf], ("anna",))


def test_what_was_said_is_no_look_of_a_memory_file(memory):
    """It said that somebody had looked there."""
    memory.observe(TABLE, [Sighting("keys"), Sighting("mug")])
    memory.step()
    memory.note_moved("keys", SHELF, "anna")
    memory.picked_up("mug")
    memory.put_down("mug", DRAWER)
    memory.step()
    story = StillMemory(memory.copy(), "home.sgm")
    assert [(look.step, look.furniture) for look in story.looks] == [(0, TABLE)]
    told = [
        (said.step, said.kind, said.thing, said.by, said.furniture) for said in story.statements
    ]
    assert told == [
        (1, "moved", "keys", "anna", SHELF),
        (1, "picked_up", "mug", "robot", None),
        (1, "put_down", "mug", "robot", DRAWER),
    ]
    memory.observe(SHELF, [Sighting("keys")])
    story = StillMemory(memory.copy(), "home.sgm")
    assert (2, SHELF, ("keys",)) in [(look.step, look.furniture, look.seen) for look in story.looks]


def test_furniture_removed_by_a_program_is_no_statement(memory, log):
    memory.remove_furniture(SHELF)
    assert PastMemory(read_events(log), "home").statements == ()


def test_furniture_that_is_named_and_merged_is_in_the_story(memory, log):
    memory.observe(DRAWER, [Sighting("keys")])
    memory.name_furniture(SHELF, "desk", "white desk")
    memory.merge_furniture(SHELF, DRAWER)
    story = PastMemory(read_events(log), "home")
    told = [(s.kind, s.place, s.other, s.furniture, s.merged) for s in story.statements]
    assert told == [
        ("name", "shelf in kitchen", "white desk", SHELF, None),
        ("merge_furniture", "white desk in kitchen", "drawer in kitchen", SHELF, DRAWER),
    ]


def test_things_without_statements_have_none(memory, log):
    memory.observe(TABLE, [Sighting("keys")])
    history = PastMemory(read_events(log), "home").trace_object("keys")
    assert (history.said_by, len(history.said_hour), len(history.said_place)) == ((), 0, 0)
    assert history.look_place.dtype == np.int64


def test_steps_that_tell_the_story_are_chosen(memory, log):
    """A page of 60 of 1,000 steps, at even distances, had none in which somebody spoke."""
    for step in (101, 203, 303):
        memory.step(step - memory.time)
        memory.observe(TABLE, [Sighting("keys")])
    memory.step(8)
    memory.note_moved("keys", SHELF, "anna")
    memory.step(689)
    story = PastMemory(read_events(log), "home")
    steps = story.choose_steps(12)
    assert {0, 101, 203, 303, 311, 1000} < set(steps)
    assert len(steps) == 12
    assert steps == sorted(steps)
    assert story.choose_steps(2) == [0, 1000]
    assert story.choose_steps(3) == [0, 311, 1000]
    assert story.choose_steps(5) == [0, 101, 303, 311, 1000]
    assert StillMemory(memory, "home.sgm").choose_steps(60) == [1000]


def test_few_steps_are_all_chosen(memory, log):
    memory.step(5)
    assert PastMemory(read_events(log), "home").choose_steps(60) == [0, 1, 2, 3, 4, 5]

"""What is no look, within a step, keeps what the looks of this step have shown."""

from contextlib import suppress
from functools import cache

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian, Frequentist
from tests.sgm.memory.sessions import CALLS, dump

TABLE, SHELF, DESK, BENCH, STOOL = range(5)
POLICIES = pytest.mark.parametrize("policy", [Frequentist, Bayesian, Adaptive])
CHANGES = {
    "furniture": lambda memory: memory.add_furniture("bathtub", 1),
    "room": lambda memory: memory.add_room("attic"),
    "name of a room": lambda memory: memory.rename_room(1, "bath"),
    "name of furniture": lambda memory: memory.name_furniture(DESK, "desk", "old desk"),
    "position": lambda memory: memory.move_furniture(DESK, position=(3.0, 1.0)),
    "map": lambda memory: memory.transform(0.3, (1.0, 2.0)),
    "thing known before": lambda memory: memory.rename("fork", "spoon"),
    "thing of this step": lambda memory: memory.rename("pen", "pencil"),
    "thing with an id": lambda memory: memory.rename("7", "book"),
    "one thing": lambda memory: memory.merge("fork", "plate"),
    "one thing of this step": lambda memory: memory.merge("fork", "pen"),
    "two things again": lambda memory: (memory.merge("cap", "pen"), memory.split("cap")),
    "said": lambda memory: memory.note_moved("fork", DESK, "anna"),
    "said of a new thing": lambda memory: memory.note_moved("zebra", DESK, "anna"),
    "said of a thing of this step": lambda memory: memory.note_moved("cap", DESK, "anna"),
    "said where it is": lambda memory: memory.note_moved("pen", TABLE, "anna", "onTop"),
    "picked up": lambda memory: memory.picked_up("plate"),
    "carried elsewhere": lambda memory: (memory.picked_up("cap"), memory.put_down("cap", DESK)),
    "not found": lambda memory: memory.note_absent(DESK, "plate"),
    "forgotten": lambda memory: memory.forget("fork"),
    "forgotten of this step": lambda memory: memory.forget("cap"),
    "removed": lambda memory: memory.remove_object("plate"),
    "place forgotten": lambda memory: memory.forget(BENCH),
    "looked at and forgotten": lambda memory: memory.forget(STOOL),
    "place removed": lambda memory: memory.remove_furniture(BENCH),
    "room removed": lambda memory: memory.remove_room(2),
    "one place": lambda memory: memory.merge_furniture(DESK, BENCH),
    "one place of looks": lambda memory: memory.merge_furniture(TABLE, STOOL),
    "split": lambda memory: memory.split("vase", SHELF, "urn"),
    "split before": lambda memory: memory.split("vase", TABLE, "urn"),
    "split within the step": lambda memory: memory.split("comb", STOOL, "brush"),
    "box": lambda memory: memory.move_furniture(TABLE, box=Box((1, 2, 0.5), (1, 1, 1))),
    "other room": lambda memory: memory.move_furniture(BENCH, 1),
    "question": lambda memory: memory.query("fork"),
    "said, then gone": lambda memory: (
        memory.note_moved("cap", STOOL, "anna"),
        memory.forget(STOOL),
    ),
    "said, then renamed": lambda memory: (
        memory.note_moved("cap", DESK, "anna"),
        memory.rename("cap", "hat"),
    ),
    "said, then split": lambda memory: (
        memory.note_moved("comb", DESK, "anna"),
        memory.split("comb", DESK, "brush"),
    ),
}
# Every call that is no look and writes changes something here; those of time end the step.
TRIED_ELSEWHERE = {"observe", "note_found", "step", "step_to", "start_clock"}


def make_memory(num_before: int, num_now: int) -> SceneGraphMemory:
    """Return a copy of a memory amid a step, which is made once."""
    return _make_memory(num_before, num_now).copy()


@cache
def _make_memory(num_before: int, num_now: int) -> SceneGraphMemory:
    memory = SceneGraphMemory()
    rooms = [memory.add_room(label) for label in ("kitchen", "bathroom", "hall")]
    for label in ("table", "shelf", "desk", "bench"):
        memory.add_furniture(label, rooms[0])
    memory.add_furniture("stool", rooms[2])
    things = [Sighting(name) for name in ("fork", "plate", "vase")]
    memory.observe(TABLE, [*[Sighting("lamp")] * num_before, *things])
    memory.step()
    memory.observe(SHELF, [Sighting("lamp")] * num_now + [Sighting("vase"), Sighting("comb")])
    memory.observe(STOOL, [Sighting("comb")])
    memory.observe(TABLE, [Sighting("pen", position=(1, 2, 1)), Sighting("paper", id="7")])
    memory.note_absent(DESK, "pen")
    memory.observe(TABLE, [Sighting("pen", position=(1, 2, 1)), Sighting("paper", id="7")])
    memory.observe(SHELF, [Sighting("lamp")] * num_now + [Sighting("vase"), Sighting("cap")])
    return memory


def rank(memory, policy):
    ranking = Finder(policy()).rank(memory, "lamp")
    places = {place.furniture: place.probability for place in ranking}
    return np.array([*(places[n] for n in (TABLE, SHELF, DESK)), ranking.elsewhere])


@cache
def rank_before(num_before: int, num_now: int, policy):
    return rank(make_memory(num_before, num_now), policy)


@POLICIES
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("num_before", [1, 2])
@pytest.mark.parametrize("num_now", [1, 2])
def test_no_other_thing_changes(policy, change, num_before, num_now):
    """A lamp that two were seen of went from 3 % to 48 % at its old place."""
    memory, before = make_memory(num_before, num_now), rank_before(num_before, num_now, policy)
    CHANGES[change](memory)
    np.testing.assert_allclose(rank(memory, policy), before, atol=0.05)
    memory.observe(DESK, [])
    assert memory.ask(["lamp"]).num_instances.tolist() == [max(num_before, num_now)]


def test_all_calls_that_write_are_tried():
    import inspect

    source = inspect.getsource(inspect.getmodule(make_memory))
    tried = {name for name in CALLS if f"memory.{name}(" in source}
    assert tried | TRIED_ELSEWHERE == {*CALLS}


@pytest.mark.parametrize("change", CHANGES)
def test_what_was_seen_and_missed_in_this_step_still_was(change):
    memory = make_memory(1, 1)
    before, missed = memory.last_seen("lamp"), memory.ask(["lamp"]).looks.negative[0, :3]
    CHANGES[change](memory)
    assert memory.last_seen("lamp") == before
    missed[0] += change == "one place of looks"  # whose look is one more at the table
    assert memory.ask(["lamp"]).looks.negative[0, :3].tolist() == missed.tolist()
    pen = memory.last_seen("pencil" if change == "thing of this step" else "pen")
    assert (pen.furniture, pen.steps_ago, pen.is_there) == (TABLE, 0, True)
    if memory.num_furniture > BENCH and change != "looked at and forgotten":
        memory.observe(SHELF, [])
        assert not memory.last_seen("lamp").is_there


@pytest.mark.filterwarnings("ignore::sgm.memory.memory_looks.LookPerFrameWarning")
def test_what_was_said_is_news_for_the_looks_of_this_step():
    """Ten looks had missed it before, or shown it elsewhere."""
    memory = make_memory(1, 1)
    for _ in range(10):
        memory.observe(DESK, [])
    memory.note_moved("fork", DESK, "anna")
    places = {place.furniture: place for place in Finder(Adaptive()).rank(memory, "fork")}
    assert places[DESK].probability == pytest.approx(0.9, abs=0.02)
    for _ in range(2):
        memory.observe(DESK, [])
    later = {place.furniture: place for place in Finder(Adaptive()).rank(memory, "fork")}
    assert later[DESK].probability < 0.6
    memory.note_moved("cap", DESK, "anna")
    memory.observe(SHELF, [Sighting("cap")])
    assert memory.last_seen("cap").furniture == SHELF


@pytest.mark.parametrize("change", CHANGES)
def test_it_is_saved_as_it_is(change, tmp_path):
    memory = make_memory(1, 2)
    CHANGES[change](memory)
    memory.save(tmp_path / "home.sgm")
    for other in (memory.copy(), SceneGraphMemory.load(tmp_path / "home.sgm")):
        assert dump(other) == dump(memory)
        assert other.to_dict() == memory.to_dict()
        np.testing.assert_array_equal(rank(other, Adaptive), rank(memory, Adaptive))
        assert other.list_statements() == memory.list_statements()
        other.step()
        other.observe(TABLE, [Sighting("pen")])
        again = memory.copy()
        again.step()
        again.observe(TABLE, [Sighting("pen")])
        assert dump(other) == dump(again)


@pytest.mark.slow
@pytest.mark.parametrize("first", CHANGES)
def test_to_read_a_memory_between_two_changes_makes_no_difference(first):
    """What was seen in a room that was removed was known, or not, by whether it was read before."""

    def change(memory: SceneGraphMemory, name: str) -> None:
        with suppress(ValueError, KeyError):  # it is gone by then
            CHANGES[name](memory)

    read = make_memory(1, 2)
    change(read, first)
    dump(read)
    for second in CHANGES:
        one, other = make_memory(1, 2), read.copy()
        change(one, first)  # each time: to copy a memory reads it
        change(one, second)
        change(other, second)
        assert dump(one) == dump(other), second


def test_what_was_renamed_has_been_seen_and_missed_under_its_new_name():
    memory = make_memory(1, 1)
    memory.rename("pen", "pencil")
    memory.rename("7", "book")
    assert [memory.last_seen(thing).steps_ago for thing in ("pencil", "7")] == [0, 0]
    assert memory.last_seen("pencil").times_looked == 1
    assert memory.ask(["pencil"]).looks.negative[0].tolist() == [0, 2, 1, 0, 1]
    assert not {"pen", "paper"} & set(memory.descriptions)

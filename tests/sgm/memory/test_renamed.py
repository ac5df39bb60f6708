"""What a person calls a thing is what it is called, whatever the detector goes on to say."""

import json

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.replay.replay import replay

TABLE, SHELF, DESK = range(3)


def make_memory(**arguments):
    memory = SceneGraphMemory(**arguments)
    room = memory.add_room("kitchen")
    for label in ("table", "shelf", "desk"):
        memory.add_furniture(label, room)
    memory.observe(TABLE, [Sighting("cup")])
    return memory


def list_there(memory):
    return {(name, seen.furniture) for name, seen in memory.list_seen()[0] if seen.is_there}


@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("said", ["cup", "Cup", "the cup"])
def test_it_lasts_beyond_the_next_look(steps, said):
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    for _ in range(5):
        memory.step(steps)
        memory.observe(TABLE, [Sighting(said), Sighting("pen")])
        assert list_there(memory) == {("bowl", TABLE), ("pen", TABLE)}
    assert memory.last_seen("bowl").times_seen == 1 + 5 * steps
    assert "cup" not in memory.descriptions
    memory.observe(TABLE, [])
    assert not memory.last_seen("bowl").is_there


def test_a_cup_elsewhere_is_a_cup():
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.observe(DESK, [Sighting("cup")])
    assert list_there(memory) == {("bowl", TABLE), ("cup", DESK)}


def test_it_holds_until_it_is_undone():
    memory = make_memory()
    for _ in range(2):
        memory.rename("cup", "bowl", "anna")
        memory.step()
        memory.observe(TABLE, [Sighting("cup")])
        assert list_there(memory) == {("bowl", TABLE)}
        memory.rename("bowl", "cup", "tom")
        memory.step()
        memory.observe(TABLE, [Sighting("cup")])
        assert list_there(memory) == {("cup", TABLE)}


def test_what_is_renamed_twice_is_called_as_last():
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.rename("bowl", "sugar bowl", "tom")
    memory.observe(TABLE, [Sighting("cup")])
    assert list_there(memory) == {("sugar bowl", TABLE)}
    memory.observe(TABLE, [Sighting("cup"), Sighting("bowl")])  # another thing
    assert list_there(memory) == {("sugar bowl", TABLE), ("bowl", TABLE)}


def test_a_detector_that_learns_the_name_is_understood():
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.observe(TABLE, [Sighting("bowl")])
    assert list_there(memory) == {("bowl", TABLE)}


def test_an_id_keeps_its_name_wherever_it_is():
    memory = make_memory()
    memory.observe(SHELF, [Sighting("cup", id="7"), Sighting("cup", id="8")])
    memory.rename("7", "bowl", "anna")
    memory.observe(DESK, [Sighting("cup", id="7")])
    memory.observe(SHELF, [Sighting("cup", id="8")])
    assert list_there(memory) == {("cup", TABLE), ("bowl", DESK), ("cup", SHELF)}


def test_of_several_of_a_name_it_is_said_that_ids_alone_tell():
    memory = make_memory()
    service = MemoryService(memory, Finder(Adaptive()), None)
    memory.observe(TABLE, [Sighting("cup"), Sighting("cup")])
    noted = service.rename("cup", "bowl", "anna")
    assert noted.said.endswith("there are several, of which ids alone tell which is no cup")
    memory.step()
    memory.observe(TABLE, [Sighting("cup")])  # one of them, or another one
    assert memory.last_seen("cup").is_there
    assert service.rename("cup", "mug", "anna").said == "anna said that cup is called mug"


def test_what_is_forgotten_or_gone_is_called_so_no_more():
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.forget("bowl", "anna")
    memory.observe(TABLE, [Sighting("cup")])
    assert list_there(memory) == {("cup", TABLE)}
    memory.rename("cup", "bowl", "anna")
    memory.merge_furniture(SHELF, TABLE)
    memory.observe(SHELF, [Sighting("cup")])
    assert list_there(memory) == {("bowl", SHELF)}


def test_files_copies_and_logs_know_it(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    memory.rename("cup", "bowl", "anna")
    memory.observe(TABLE, [Sighting("cup")])
    memory.save(tmp_path / "home.sgm")
    memory.step()
    others = [SceneGraphMemory.load(tmp_path / "home.sgm"), memory.copy()]
    others[0].step()
    *_, (replayed, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    for one in (memory, replayed, *others):
        one.observe(TABLE, [Sighting("cup")])
        assert json.dumps(one.to_dict()) == json.dumps(memory.to_dict())
        assert list_there(one) == {("bowl", TABLE)}
    last = read_events(tmp_path / "looks.sgm")[-1]
    assert last.values["seen"][0][0] == "cup"  # as the detector says


def test_what_a_robot_finds_is_called_as_it_was_asked_for():
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    search = Finder(Adaptive()).search(memory, "cup")  # another thing now
    while search.next().place.furniture != TABLE:
        search.not_found()
    search.found()
    assert list_there(memory) == {("bowl", TABLE), ("cup", TABLE)}
    assert Finder(Adaptive()).rank(memory, "cup")[0].probability > 0.9


# What names a thing as the memory calls it, and not as a detector does.
NAMES = {
    "found": lambda memory: memory.note_found(TABLE, "cup", "in"),
    "moved": lambda memory: memory.note_moved("cup", TABLE, "anna", "in"),
    "put down": lambda memory: (memory.picked_up("cup"), memory.put_down("cup", TABLE, "in")),
}


@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_what_is_said_of_a_thing_is_not_of_one_that_was_called_so(tmp_path, name, steps):
    memory = make_memory(path=tmp_path / "home.sgm")
    memory.rename("cup", "bowl", "anna")
    memory.step(steps)
    NAMES[name](memory)
    other = SceneGraphMemory.load(tmp_path / "home.sgm")  # as the events make it again
    assert list_there(other) == list_there(memory) == {("bowl", TABLE), ("cup", TABLE)}
    assert memory.last_seen("cup").relation == "in"
    assert memory.last_seen("bowl").relation == "onTop"
    assert memory.history("cup")[0].furniture == TABLE
    memory.step(steps)
    memory.observe(TABLE, [Sighting("cup"), Sighting("cup")])  # one is the bowl
    assert list_there(memory) == {("bowl", TABLE), ("cup", TABLE)}
    memory.note_absent(TABLE, "cup")
    assert memory.last_seen("bowl").is_there
    assert not memory.last_seen("cup").is_there
    memory.close()


def test_what_is_found_is_no_score():
    memory = make_memory(score_calibration=ScoreCalibration.open_vocabulary())
    memory.note_found(DESK, "pen")
    assert memory.history("pen")[0].confidence == 1


@pytest.mark.parametrize("steps", [0, 1])
def test_what_is_found_has_its_id(steps):
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.observe(SHELF, [Sighting("cup", id="7"), Sighting("cup", id="8")])
    memory.step(steps)
    memory.note_found(TABLE, "8")
    assert list_there(memory) == {("bowl", TABLE), ("cup", SHELF), ("cup", TABLE)}
    assert [memory.last_seen(id).furniture for id in ("7", "8")] == [SHELF, TABLE]


@pytest.mark.parametrize("steps", [0, 1])
def test_a_search_ends_when_the_detector_shows_what_it_calls_otherwise(steps):
    memory = make_memory()
    memory.rename("cup", "bowl", "anna")
    memory.step(steps)
    finder = Finder(Adaptive())
    search, several = finder.search(memory, "bowl"), finder.search_several(memory, ["bowl"])
    for each in (search, several):
        assert each.next().place.furniture == TABLE
        assert each.seen([Sighting("cup")])
    other = finder.search(memory, "cup")  # the detector's cup there is none
    while other.next().place.furniture != TABLE:
        other.not_found()
    assert not other.seen([Sighting("cup")])


def test_what_is_out_of_view_is_called_as_people_say_or_as_a_detector_does():
    for name in ("cup", "bowl"):
        memory = make_memory()
        memory.rename("cup", "bowl", "anna")
        memory.step()
        memory.observe(TABLE, [], hidden=[name])
        assert memory.last_seen("bowl").is_there

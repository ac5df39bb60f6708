"""What is sent again, since its answer was lost, is done once, and is answered as before."""

import inspect
from datetime import datetime

import pytest

from sgm.finder.answers import to_json
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.finder.written import MOST_KEYS
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Bayesian
from tests.sgm.memory.sessions import dump

START = datetime(2026, 11, 16, 7, 30)
# Of each call that writes, arguments that a repetition would do something with.
WRITES = {
    "search_next": {"result": "not_found"},
    "observe": {"place": "desk", "seen": ["mug"]},
    "note_moved": {"thing": "keys", "place": "desk", "by": "anna"},
    "picked_up": {"thing": "mug"},
    "put_down": {"thing": "pen", "place": "desk"},
    "forget": {"thing": "mug"},
    "rename": {"thing": "mug", "name": "cup"},
    "merge": {"thing": "mug", "other": "bowl"},
    "split": {"thing": "fork"},
    "add_room": {"label": "bath"},
    "rename_room": {"room": "study", "label": "den"},
    "remove_room": {"room": "study"},
    "add_place": {"label": "sink", "room": "kitchen"},
    "name_place": {"place": "desk", "label": "table"},
    "move_place": {"place": "desk", "room": "kitchen"},
    "merge_places": {"place": "desk", "other": "shelf"},
    "remove_place": {"place": "desk"},
    "set_map": {"rooms": ["hall"], "furniture": [{"name": "bench", "room": "hall"}]},
    "transform_map": {"angle": 1.0, "shift": [1, 2]},
}


def make_service():
    memory = SceneGraphMemory(clock=Clock(START, 600))
    service = MemoryService(memory, Finder(Bayesian()), lambda: START)
    for room, label in (("study", "desk"), ("study", "shelf"), ("kitchen", "table")):
        if room not in map(str, memory.layout.rooms.values()):
            service.add_room(room)
        service.add_place(label, room, position=(1, 2))
    service.observe("desk", ["mug", "bowl", "pen", "fork"])
    service.observe("shelf", ["spoon"])
    service.merge("fork", "spoon")
    service.picked_up("pen")
    return service


def test_every_write_takes_a_key():
    takes_key = {
        name
        for name, method in inspect.getmembers(MemoryService, inspect.isfunction)
        if "key" in inspect.signature(method).parameters and not name.startswith("_")
    }
    assert takes_key == WRITES.keys()


@pytest.mark.parametrize("name", WRITES)
def test_a_write_with_a_key_is_made_once(name):
    service, happened = make_service(), []
    arguments = dict(WRITES[name])
    if name == "search_next":
        arguments["search_id"] = service.search_start("mug").search_id
    service.subscribe(happened.append)
    write = getattr(service, name)
    first = write(**arguments, key="7f3a")
    assert first.status == "ok"
    before = dump(service.memory)
    assert write(**arguments, key="7f3a") == first
    assert dump(service.memory) == before
    assert len(happened) == 1


def test_a_key_is_of_one_write():
    service = make_service()
    service.observe("desk", ["mug"], key="a")
    before = dump(service.memory)
    for again in (
        lambda: service.observe("desk", [], key="a"),
        lambda: service.observe("shelf", ["mug"], key="a"),
        lambda: service.picked_up("mug", key="a"),
    ):
        with pytest.raises(ValueError, match="key must be of one write, got 'a' of another one"):
            again()
    for key in ("", "x" * 201, 7, b"a"):
        with pytest.raises(ValueError, match="key must be a text of 1 to 200 characters"):
            service.observe("desk", [], key=key)
    assert dump(service.memory) == before


def test_what_was_not_made_may_be_sent_again_with_its_key():
    service = make_service()
    assert service.observe("sofa", [], key="a").status == "unknown"
    with pytest.raises(ValueError, match="coverage"):
        service.observe("desk", [], coverage=2, key="a")
    assert service.observe("desk", ["cup"], key="a").status == "ok"


def test_the_latest_keys_are_known():
    service = make_service()
    for number in range(MOST_KEYS + 1):
        service.move_place("desk", position=(number, 0), key=f"{number}")
    answer = service.move_place("desk", position=(1, 0), key="1")
    assert service.memory.get_position(0) == (MOST_KEYS, 0)
    assert to_json(answer)["position"] == [1.0, 0.0, 0.0]
    service.move_place("desk", position=(0, 0), key="0")  # forgotten: made again
    assert service.memory.get_position(0) == (0, 0)


@pytest.mark.parametrize("result", ["not_found", "seen"])
def test_a_step_of_a_search_with_its_number_is_noted_once(result):
    service = make_service()
    begun = service.search_start("passport")
    assert begun.next.look == 1
    seen = ["comb"] if result == "seen" else []
    first = service.search_next(begun.search_id, result, seen, look=1)
    before = dump(service.memory)
    assert service.search_next(begun.search_id, result, seen, look=1) == first
    assert dump(service.memory) == before
    assert (first.looks, first.next.look) == (1, 2)
    second = service.search_next(begun.search_id, result, seen, look=first.next.look)
    assert second.looks == 2
    assert service.search_next(begun.search_id, result, seen, look=1) == first  # late
    assert service.search_next(begun.search_id, result, seen, look=2) == second
    with pytest.raises(ValueError, match="look 1 must have come to one result"):
        service.search_next(begun.search_id, "found", look=1)
    for look in (0, 4, 2.5, "3", True):
        with pytest.raises(ValueError, match="look must be the number of the next look, 3, or of"):
            service.search_next(begun.search_id, result, seen, look=look)


def test_the_last_step_of_a_search_is_noted_once():
    service = make_service()
    begun = service.search_start("bowl")
    found = service.search_next(begun.search_id, "found", look=1)
    assert found.is_found
    assert found.next is None
    before = dump(service.memory)
    assert service.search_next(begun.search_id, "found", look=1) == found
    assert dump(service.memory) == before

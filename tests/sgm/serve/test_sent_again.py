"""A write that is sent again after a crash is answered as before, and made once."""

import json

import pytest

from sgm.finder.answers import Noted, Searching, read_answer, to_json, write_json
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Bayesian

from .conftest import START, open_service

WRITES = (
    ("observe", {"place": "desk", "seen": ["pen", {"thing": "cup", "confidence": 0.7}]}),
    ("note_moved", {"thing": "pen", "place": "white fridge", "by": "anna"}),
    ("picked_up", {"thing": "scissors"}),
    ("rename", {"thing": "pen", "name": "fountain pen"}),
    ("add_place", {"label": "shelf", "room": "study", "position": (1.25, 2)}),
    ("forget", {"thing": "milk"}),
)


def start_again(path):
    """A service of another process, after a kill: nothing was closed."""
    return MemoryService(SceneGraphMemory.open(path), Finder(Bayesian()), lambda: START)


def test_keys_are_known_after_a_crash(tmp_path):
    path = tmp_path / "home.sgm"
    _home, service = open_service(path)
    answers = [getattr(service, name)(**arguments, key=f"key {name}") for name, arguments in WRITES]
    num_events = len(read_events(path))
    again = start_again(path)
    for (name, arguments), answer in zip(WRITES, answers, strict=True):
        repeated = getattr(again, name)(**arguments, key=f"key {name}")
        assert write_json(repeated) == write_json(answer)
        assert isinstance(repeated, Noted)
    assert len(read_events(path)) == num_events
    with pytest.raises(ValueError, match="key must be of one write"):
        again.forget(thing="pen", key="key observe")


def test_looks_of_a_search_are_known_after_a_crash(tmp_path):
    path = tmp_path / "home.sgm"
    _home, service = open_service(path)
    begun = service.search_start("wine glass")
    about = {"search_id": begun.search_id, "result": "not_found", "look": 1}
    answer = service.search_next(**about)
    num_events = len(read_events(path))
    again = start_again(path)
    assert write_json(again.search_next(**about)) == write_json(answer)
    with pytest.raises(ValueError, match="must have come to one result"):
        again.search_next(**{**about, "result": "found"})
    assert again.search_next(**{**about, "look": 2}).status == "unknown"
    assert len(read_events(path)) == num_events


def test_an_answer_is_read_as_it_was_written(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm")
    searching, noted = service.search_start("mug"), service.observe("desk", ["pen"])
    for kind, answer in ((Searching, searching), (Noted, noted)):
        values = json.loads(write_json(answer))
        assert to_json(read_answer(kind, values)) == values


def test_listeners_are_told_what_is_in_the_file(tmp_path):
    path = tmp_path / "home.sgm"
    _home, service = open_service(path)
    known = []
    service.subscribe(lambda _: known.append(SceneGraphMemory.load(path).last_seen("pen")))
    service.observe("desk", ["pen"])
    assert known[0] is not None

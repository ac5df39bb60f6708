"""How people and detectors call the things of four homes, written before the rules were read."""

import json
from functools import cache
from pathlib import Path

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

# Of each home: what stands at which place, and what wordings mean; those of none are asked back.
HOMES = json.loads(Path(__file__).with_name("wordings.json").read_text("utf-8"))
CASES = [
    (home, thing, wording)
    for home, told in HOMES.items()
    for thing, wordings in told["wordings"].items()
    for wording in wordings
]
TRAPS = [(home, wording) for home, told in HOMES.items() for wording in told["asked back"]]


@cache
def make_home(home):
    memory = SceneGraphMemory()
    rooms = HOMES[home]["rooms"]
    ids = {}
    for room, places in rooms.items():
        number = memory.add_room(room)
        ids |= {place: memory.add_furniture(place, room=number) for place in places}
    for places in rooms.values():
        for place, things in places.items():
            memory.observe(ids[place], [Sighting(thing) for thing in things])
    memory.step()
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(("home", "thing", "wording"), CASES)
def test_a_wording_means_its_thing(home, thing, wording):
    answer = make_home(home).where_is(wording)
    assert (answer.status, answer.taken_for[:1]) == ("ok", (thing,)), answer.ask


@pytest.mark.parametrize(("home", "wording"), TRAPS)
def test_a_wording_of_another_thing_is_asked_back(home, wording):
    answer = make_home(home).where_is(wording)
    assert answer.status != "ok", answer.taken_for

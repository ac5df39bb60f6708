"""Sentences as people say them, of writers who have not seen the rules: right, or asked back."""

import json
from datetime import datetime
from functools import cache
from pathlib import Path

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive

# Homes with their looks; rows of home, sentence, who speaks, kind, and words of the answer. Without
# a kind the sentence is asked back.
SAID = json.loads(Path(__file__).with_name("people_say.json").read_text("utf-8"))
STEP_SECONDS = 60


@pytest.fixture(scope="module")
def homes(tmp_path_factory):
    """Return the service of a home by its name; the past is asked of its file."""
    return cache(lambda name: make_home(name, tmp_path_factory.mktemp("home") / "home.sgm"))


def make_home(name, path):
    """A home that was looked at for three days."""
    told = SAID["homes"][name]
    start = datetime.fromisoformat(told["looks"][0][0]).replace(hour=0, minute=0)
    memory = SceneGraphMemory(path=path, clock=Clock(start, STEP_SECONDS))
    ids = {}
    for room, places in told["rooms"].items():
        number = memory.add_room(room)
        ids |= {place: memory.add_furniture(place, room=number) for place in places}
    for at, place, seen in told["looks"]:
        step_to(memory, start, at)
        memory.observe(ids[place], [Sighting(name) for name in seen])
    step_to(memory, start, told["now"])
    return MemoryService(memory, Finder(Adaptive()), None)


def step_to(memory, start, at):
    step = int((datetime.fromisoformat(at) - start).total_seconds() // STEP_SECONDS)
    if step > memory.time:
        memory.step(step - memory.time)


@pytest.mark.parametrize(("home", "sentence", "speaker", "kind", "said"), SAID["sentences"])
def test_a_sentence_is_answered_right_or_asked_back(home, sentence, speaker, kind, said, homes):
    answer = homes(home).ask(sentence, speaker=speaker)
    assert (answer.status == "ok", answer.kind if kind else "") == (bool(kind), kind), answer.said
    told = answer.said.casefold()
    assert [words for words in said if words not in told] == []


@pytest.mark.parametrize(
    "sentence",
    [
        "Soap, towel, toothbrush - where?",  # no towel is known
        "can I eat the yogurt?",
        "where can I recycle the newspaper?",
        "where does milk come from",
        "is the notebook where it was this morning?",
        "have we run out of bread or what",
        "did Tom take the scissors?",
        "do you like the cushion?",
        "Read me the cookbook.",
    ],
)
def test_what_asks_something_else_is_asked_back(sentence, homes):
    answer = homes("e1 h1").ask(sentence)
    assert answer.status != "ok", answer.said


def test_what_is_for_breakfast_is_no_past(homes):
    answer = homes("e1 h1").ask("Anything in the fridge for breakfast?")
    assert answer.said == "In the fridge: cheese, orange juice and yogurt."


def test_what_the_last_look_missed_is_not_said_to_be_there(tmp_path):
    """The charger lay on the desk twice, and the last look there did not show it."""
    start = datetime(2026, 11, 30, 8)
    memory = SceneGraphMemory(path=tmp_path / "home.sgm", clock=Clock(start, 3600))
    desk = memory.add_furniture("desk", room=memory.add_room("office"))
    for shown in (["charger", "pen"], ["charger", "pen"], ["pen"]):
        memory.observe(desk, [Sighting(name) for name in shown])
        memory.step(2)
    service = MemoryService(memory, Finder(Adaptive()), None)
    for asked in ("Is the charger on the desk?", "Is there any charger?"):
        answer = service.ask(asked)
        assert answer.status == "ok"
        assert answer.said.startswith("Not seen"), answer.said
    assert service.ask("Is the pen on the desk?").said.startswith("Yes")
    assert service.ask("Was the charger on the desk an hour ago?").said.startswith("Probably not")
    assert "charger" not in service.ask("What was on the desk an hour ago?").said
    assert service.ask("Where was the charger four hours ago?").status == "ok"

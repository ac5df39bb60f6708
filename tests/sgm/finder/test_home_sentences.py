"""Sentences in two homes, written before the rules were read: right, or asked back."""

import json
from functools import cache
from pathlib import Path

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

# Of each home: what stands at which place; sentences, and words of the answer, none if asked back.
HOMES = json.loads(Path(__file__).with_name("home_sentences.json").read_text("utf-8"))
CASES = [
    (home, row["asked"], row["speaker"], row["said"], row["never"])
    for home, told in HOMES.items()
    for row in told["sentences"]
]


@cache
def make_home(home):
    memory = SceneGraphMemory()
    rooms = HOMES[home]["rooms"]
    numbers = {room: memory.add_room(room) for room in rooms}
    for room, places in rooms.items():
        for place, things in places.items():
            number = memory.add_furniture(place, room=numbers[room])
            memory.observe(number, [Sighting(thing) for thing in things])
    memory.step()
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(("home", "asked", "speaker", "said", "never"), CASES)
def test_a_sentence_is_answered_right_or_asked_back(home, asked, speaker, said, never):
    answer = make_home(home).ask(asked, speaker=speaker)
    assert (answer.status == "ok") == bool(said), answer.said
    told = answer.said.casefold()
    assert [words for words in said if words not in told] == []
    if said:
        assert [words for words in never if words.casefold() in told] == []


@pytest.mark.parametrize(
    "asked",
    [
        "Which mug is the heaviest, and where is it?",  # two questions
        "The mug on the desk is gone, where is it?",  # which one, a place says
        "I do not want the kettle, where is it?",
        "It is not the kettle, where is it?",
        "frobnicate the hammer, where is zorb?",
    ],
)
def test_what_is_said_before_a_question_is_not_dropped_if_it_may_say_more(asked):
    answer = make_home("family house").ask(asked)
    assert answer.status != "ok", answer.said


def test_known_things_before_a_question_are_asked_for_too():
    answer = make_home("family house").ask("I need the hammer and the kettle, where is the fork?")
    assert answer.status == "ok"
    assert [thing for thing in ("hammer", "kettle", "fork") if thing not in answer.said] == []


def test_a_german_question_is_parted_from_what_is_said_before_it():
    memory = SceneGraphMemory(language="de")
    kitchen = memory.add_room("küche")
    places = [memory.add_furniture(name, room=kitchen) for name in ("tisch", "schrank")]
    memory.observe(places[0], [Sighting("roter becher"), Sighting("annas brille")])
    memory.observe(places[1], [Sighting("blauer becher"), Sighting("annas handy")])
    service = MemoryService(memory, Finder(Adaptive()), None)
    for asked, told in (
        ("Ich habe Kopfweh, wo ist der rote Becher?", "tisch"),
        ("Ich brauche den blauen Becher. Wo ist er?", "schrank"),
        ("der rote Becher, nein, der blaue Becher", "schrank"),
        ("wo sind Annas Sachen", "handy"),
    ):
        answer = service.ask(asked)
        assert (answer.status, told in answer.said.casefold()) == ("ok", True), answer.said

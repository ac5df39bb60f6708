"""Sentences of a person: the kind of question, the answer in words, and what is asked back.

`sentences.txt` has three hundred of them with right answers; they were written with the rules.
"""

from datetime import datetime
from functools import cache
from pathlib import Path

import pytest

from sgm.finder.answers import to_json
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.names.asking import make_asking
from sgm.policies import Adaptive

LINES = Path(__file__).with_name("sentences.txt").read_text("utf-8").splitlines()
ROWS = [tuple(cell.strip() for cell in line.split(" | ")) for line in LINES if line[0] != "#"]
PLACES = {
    "counter": 0,
    "drawer": 0,
    "sink": 0,
    "dinner table": 0,
    "cabinet": 0,
    "fridge": 0,
    "desk": 1,
    "sofa": 2,
}
MORNING = {
    "counter": ("red mug", "blue mug", "keys", "wallet"),
    "dinner table": ("pringles",),
    "cabinet": ("pringles", "coffee"),
    "fridge": ("milk", "fanta", "coke"),
    "desk": ("anna's phone", "tom's phone", "tablet", "glasses"),
    "sofa": ("remote", "cat"),
}
LATER = {
    "desk": ("anna's phone", "tom's phone", "keys", "glasses"),
    "counter": ("red mug", "blue mug", "wallet"),
}


@cache
def make_service():
    """A home on Wednesday morning, in the afternoon, and on Thursday at 10:10."""
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 18, 7, 30), 600))
    for room in ("kitchen", "study", "living room"):
        memory.add_room(room)
    ids = {label: memory.add_furniture(label, room) for label, room in PLACES.items()}
    for label, place in ids.items():
        memory.observe(place, [Sighting(name) for name in MORNING.get(label, ())])
    memory.step(60)
    for label, names in LATER.items():
        memory.observe(ids[label], [Sighting(name) for name in names])
    memory.step(100)
    memory.note_moved("wallet", ids["drawer"], "anna")
    return MemoryService(memory, Finder(Adaptive()), None)


def test_there_are_three_hundred_sentences():
    assert len({sentence for *_, sentence in ROWS}) >= 300


@pytest.mark.parametrize(("kind", "first", "second", "sentence"), ROWS)
def test_a_sentence_is_answered_or_asked_back(kind, first, second, sentence):
    answer = make_service().ask(sentence)
    if kind == "-":
        assert answer.status != "ok", answer.said
        assert answer.said == answer.ask
        return
    assert (answer.status, answer.kind) == ("ok", kind), answer.said
    said = answer.said.casefold()
    assert first.casefold() in said
    assert second.casefold() in said


def test_the_numbers_stand_beside_the_words():
    service = make_service()
    answer = service.ask("is the remote on the sofa?")
    assert answer.said == f"Yes, the remote is on the sofa ({answer.probability:.0%})."
    assert answer.where[0].places[0].probability == answer.probability
    rows = service.ask("what's in the fridge?").things
    assert {row.thing for row in rows} == {"milk", "fanta", "coke"}
    moved = service.ask("did anybody move my wallet?").changes
    assert [row.what for row in moved] == ["moved"]
    assert service.ask("where has the wallet been?").events[0].by == "anna"
    assert "probability" not in to_json(service.ask("what changed?"))


def test_who_speaks_has_a_phone():
    service = make_service()
    assert service.ask("where is my phone?").status == "ambiguous"
    answer = service.ask("where is my phone?", speaker="Tom")
    assert answer.where[0].taken_for == ("tom's phone",)


def test_what_is_left_out_is_not_told():
    for sentence in ("everything in the fridge but the milk", "what is in the fridge but milk?"):
        assert {row.thing for row in make_service().ask(sentence).things} == {"fanta", "coke"}


def test_a_part_of_a_room_is_left_out():
    rows = make_service().ask("what is in the kitchen but not in the fridge?").things
    assert {"milk", "fanta", "coke"}.isdisjoint({row.thing for row in rows})
    assert {"red mug", "blue mug"} <= {row.thing for row in rows}


@pytest.mark.parametrize(
    ("sentence", "meant"),
    [
        ("the phone that is not mine", ["anna's phone"]),
        ("any phone but mine", ["anna's phone"]),
        ("my phone and my glasses", ["tom's phone", "glasses"]),
        ("where are the phones?", ["anna's phone", "tom's phone"]),
    ],
)
def test_each_thing_of_a_name_has_a_place_of_its_own(sentence, meant):
    answer = make_service().ask(sentence, speaker="Tom")
    assert [found.taken_for for found in answer.where] == [(name,) for name in meant], answer.said
    assert answer.status == "ok"


@pytest.mark.parametrize(("at_table", "number"), [(0, 3), (1, 4), (2, 5)])
def test_an_answer_says_that_several_of_one_name_are_known(at_table, number):
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    shelf, table = (memory.add_furniture(name, kitchen) for name in ("shelf", "table"))
    memory.observe(shelf, [Sighting("mug")] * 3)
    memory.observe(table, [Sighting("mug")] * at_table)
    answer = MemoryService(memory, Finder(Adaptive()), None).ask("where is the mug?")
    likely = [place for place in answer.where[0].places if place.probability >= 0.5]
    told = " and ".join(f"the {place.name} ({place.probability:.0%})" for place in likely)
    assert len(likely) == 1 + (at_table > 0)
    assert answer.said.startswith("The mug is ")
    assert answer.said.endswith(f"I know {number} of them{f': {told}' if at_table else ''}.")


def test_a_deck_of_cards_is_one_thing():
    asking = make_asking("en")
    assert asking.tell("is sure", "deck of cards", where="x", percent="9%").endswith(
        "is at x (9%)."
    )
    assert asking.tell("is sure", "cards", where="x", percent="9%").endswith("are at x (9%).")


def test_a_memory_without_a_clock_knows_no_yesterday():
    memory = SceneGraphMemory()
    desk = memory.add_furniture("desk", memory.add_room("study"))
    memory.observe(desk, [Sighting("keys")])
    service = MemoryService(memory, Finder(Adaptive()), None)
    answer = service.ask("where were my keys yesterday?")
    assert answer.status == "ambiguous"
    assert answer.ask == "I do not know when yesterday is: the memory has no clock."
    with pytest.raises(ValueError, match="be one line"):
        service.ask("where are\nmy keys?")

"""All that an answer shows a person is of its language: a walk over the answers of every call."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from datetime import datetime
from typing import get_args

import pytest

from sgm.finder import answers as answer_types
from sgm.finder.answers import Status
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.names.language import list_languages, load_answers
from sgm.names.resolution import Resolution
from sgm.policies import Adaptive

# English words that German has none of.
STOP_WORDS = frozenset(
    "the is are at and of on to it its that this there not no nor here seen said by with without "
    "ago step steps look looks yesterday tomorrow today found moved picked put gone new since "
    "known nothing which you mean mug mugs keys counter desk kitchen study thing things place "
    "places budget elsewhere after robot wallet drawer similar prior one two called".split()
)
SHOWN = ("said", "ask", "why", "words", "outcome")  # what a person reads of an answer


@pytest.fixture(params=[True, False], ids=["clock", "steps"])
def service(request):
    clock = Clock(datetime(2026, 11, 18, 7, 30), 600) if request.param else None
    memory = SceneGraphMemory(clock=clock, language="de")
    for room in ("kitchen", "study"):
        memory.add_room(room)
    counter, desk, drawer = (
        memory.add_furniture(label, room, None, stand)
        for label, room, stand in (
            ("counter", 0, (0.0, 0.0)),
            ("desk", 1, (4.0, 0.0)),
            ("drawer", 1, (5.0, 0.0)),
        )
    )
    place = (1.0, 2.0, 0.9)
    memory.observe(counter, [Sighting("red mug", position=place), Sighting("keys")])
    memory.observe(desk, [Sighting("wallet"), Sighting("blue mug")])
    memory.step(100)
    memory.observe(counter, [Sighting("keys")])
    memory.observe(drawer, [])
    return MemoryService(memory, Finder(Adaptive()), None)


def play(service: MemoryService) -> Iterator[object]:
    """Yield the answers of all calls, and what prints itself."""
    asked = """Wo sind die Schlüssel?|Wo ist der rote Becher?|Wo ist der Becher?|Zorb|Wo ist es?
    die Schlüssel und der Geldbeutel|Wo wird der Geldbeutel sein?|Wo war der Geldbeutel gestern?
    Wo war der Geldbeutel vor einer Stunde?|Ist der Geldbeutel auf dem Schreibtisch?
    Ist der Geldbeutel in der Küche?|Was ist in der Küche?|Was ist in der Schublade?
    Wie viele Becher gibt es?|In welchem Zimmer ist der Geldbeutel?|Wo ist die Küche?
    Wann hast du zuletzt die Schlüssel gesehen?|Wer hat die Schlüssel?
    Hat jemand den roten Becher bewegt?|Was hat sich verändert?|der Becher in der Schublade
    Was wird morgen um 8 Uhr auf der Arbeitsplatte sein?
    der zorbige Becher|der Becher auf dem Mond|Wo ist der Schreibtisch?|Danke"""
    for text in re.split(r"\||\n", asked):
        for call in (service.ask, service.where_is):
            yield call(text.strip())
    for call in (service.changes, service.list_places, service.list_things):
        yield call(0) if call == service.changes else call()
    for thing in ("die Schlüssel", "der rote Becher", "Becher"):
        yield service.history(thing)
        yield service.finder.rank(service.memory, thing)
        yield service.finder.search_plan(service.memory, thing)
    yield service.search_start("es")
    yield service.search_next("none", "not_found", look=1)
    for thing, start in (("Geldbeutel", "Schublade"), ("Zorb", None), ("Schreibtisch", None)):
        search = service.search_start(thing, start, budget=3 if start is None else None)
        for _ in range(9):
            yield search
            if search.next is None:
                break
            search = service.search_next(search.search_id, "not_found", look=search.next.look)
    yield service.note_moved("Schlüssel und Geldbeutel", "Schublade", "Anna")
    yield service.note_moved("es", "Schublade", "Anna")
    yield service.picked_up("Schlüssel")
    yield service.ask("Wo sind die Schlüssel?")
    yield service.put_down("Schlüssel", "Schreibtisch")
    yield service.observe("Arbeitsplatte", ["red mug", "bowl"])
    yield service.rename("roter Becher", "cup")
    yield service.merge("cup", "blue mug")
    yield service.split("cup")
    yield service.forget("bowl", by="robot")
    yield service.changes(0)
    yield service.expect("Arbeitsplatte", service.memory.time + 144)
    yield service.learnt()
    yield service.next_looks()
    yield service.finder.learnt(service.memory)
    yield from service.finder.expect(service.memory, 0)
    yield service.history("keys")
    yield service.where_is("Schlüssel")
    yield service.add_room("bathroom")
    yield service.rename_room("bathroom", "bedroom")
    yield service.add_place("shelf", "bedroom")
    yield service.name_place("shelf", "bed")
    yield service.move_place("bed", position=(9.0, 1.0))
    yield service.merge_places("Schreibtisch", "Schublade")
    yield service.set_map(["hallway"], [{"name": "bench", "room": "hallway"}])
    yield service.set_map(["hallway"], [{"name": "bench", "room": "hallway"}])
    yield service.transform_map(1.0)
    yield service.remove_place("bench")
    yield service.remove_room("bedroom")
    yield service.forget(place="Schreibtisch")


def list_texts(answer: object) -> Iterator[str]:
    """List what an answer shows a person, and what it holds shows."""
    if not is_dataclass(answer):
        return
    if not hasattr(answer_types, type(answer).__name__):
        yield str(answer)
        return
    for field in fields(answer):
        value = getattr(answer, field.name)
        if field.name in SHOWN and isinstance(value, str):
            yield value
        for held in value if isinstance(value, (tuple, list)) else (value,):
            yield from list_texts(held)


def test_no_word_of_an_answer_in_german_is_english(service):
    told = list(play(service))
    kinds = {type(answer).__name__ for answer in told}
    assert {"Answered", "WhereIs", "Noted", "Searching", "ChangeList", "EventList"} <= kinds
    statuses = {getattr(answer, "status", "ok") for answer in told}
    assert statuses == set(get_args(Status))
    for answer in told:
        for text in list_texts(answer):
            words = re.sub(r"'[^']*'|list_\w+|search_\w+|\w+:", " ", text).split()
            english = STOP_WORDS.intersection(word.strip("(),.;:?!") for word in words)
            assert not english, (text, answer)


@pytest.mark.parametrize("code", list_languages())
def test_no_sentence_stands_twice(code):
    answers = load_answers(code)
    names = [n for section in answers for n in answers[section] if section not in ("names", "how")]
    assert len(names) == len(set(names))
    ways: Mapping[str, str] = answers["how"]
    for how in ways:
        assert Resolution("x", ("y",), how, language=code).how in ways

"""Sentences that no pattern fits: read by their words, or asked back where one may say more."""

from functools import cache

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

HOME = {
    "kitchen": {"counter": ["kettle", "red mug"], "fridge": ["milk", "butter"]},
    "hall": {"shelf": ["torch", "daniel's keys"], "bench": ["priya's keys", "passports"]},
    "study": {"desk": ["laptop", "blue mug", "watering can"], "toy chest": ["football"]},
}


@cache
def make_home():
    memory = SceneGraphMemory()
    for room, places in HOME.items():
        number = memory.add_room(room)
        for place, things in places.items():
            furniture = memory.add_furniture(place, room=number)
            memory.observe(furniture, [Sighting(thing) for thing in things])
    memory.step()
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(
    ("asked", "speaker", "kind", "said"),
    [
        ("taxi's here in ten, passports??", "", "where", ["passports", "bench"]),
        ("Power's gone. Torch!", "", "where", ["torch", "shelf"]),
        ("The fern is dry. Where did the watering can go?", "", "where", ["desk"]),
        (
            "I'm late again, any idea where I dropped my keys",
            "daniel",
            "where",
            ["daniel", "shelf"],
        ),
        ("Priya forgot her keys, she's downstairs, where are they", "", "where", ["bench"]),
        ("So the football's in the fridge, yeah?", "", "is_at", ["probably not", "toy chest"]),
        ("Is it the kitchen or the hall: where's the torch?", "", "where", ["shelf"]),
        ("Before I drag the toy chest inside, what's in it?", "", "what_at", ["football"]),
        ("plese, can you serch the laptop", "", "where", ["laptop", "desk"]),
        ("How many mugs are there? I am setting up for a party.", "", "count", ["2"]),
    ],
)
def test_words_around_a_question_that_say_nothing_are_left_out(asked, speaker, kind, said):
    answer = make_home().ask(asked, speaker=speaker)
    told = answer.said.casefold()
    assert (answer.status, answer.kind) == ("ok", kind), told
    assert [words for words in said if words not in told] == []


@pytest.mark.parametrize(
    "asked",
    [
        "where is the laptop stand",  # another thing
        "laptop bag, where?",
        "where's the saw and the kettle",  # one is not known
        "Flux capacitor and kettle, where are they?",
        "Tea time. Saw and kettle, where do they live?",
        "If I had left the laptop on the bench, where would it be?",
        "Is the butter still good?",
        "Where should I put the kettle?",  # not where it is
        "Who wants the kettle?",
        "Where was the kettle made?",
        "Where was I when I saw the laptop?",
        "the dented kettle, where is it, not that one",
        "I don't need the torch",
        "never fetch the torch, where is it",
        "the kettle, the one from grandma, where",
        "the kettle, from Zoe, where is it?",
        "the laptop, the other one, where is it?",
        "Where does Tom hide from the laptop?",
        "the green one, where is the mug",
        "Turn off the kettle",
        "I put the kettle in the fridge",
    ],
)
def test_a_word_that_may_say_more_is_asked_back(asked):
    answer = make_home().ask(asked)
    assert answer.status != "ok", answer.said


def test_a_phrase_is_read_as_it_was_before_where_a_pattern_fits():
    answer = make_home().ask("did anybody move the torch? I fell over it.")
    assert (answer.status, answer.kind) == ("ok", "moved")

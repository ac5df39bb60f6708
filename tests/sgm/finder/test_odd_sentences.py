"""Odd sentences, written before the rules were read: right, or asked back, and never wrong."""

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

LINES = Path(__file__).with_name("odd_sentences.txt").read_text("utf-8").splitlines()
ROWS = [tuple(cell.strip() for cell in line.split("|")) for line in LINES if line[0] != "#"]
START = datetime(2026, 5, 11, 7)  # a Monday; it is Friday at 17:00 when they are asked
ROOMS = {
    "kitchen": {
        "fridge": "milk;orange juice;cheese;yogurt",
        "counter": "kettle;blue mug;toaster",
        "kitchen sink": "sponge;fork;steak knife",
        "kitchen table": "white mug;Maya's laptop",
        "cutlery drawer": "kitchen scissors;spoon",
        "oven": "",
    },
    "living room": {
        "sofa": "remote control;Leo's jacket;green cushion",
        "coffee table": "magazine;red mug;reading glasses",
        "bookcase": "dictionary;chess set",
        "tv cabinet": "game console",
    },
    "office": {
        "desk": "stapler;Leo's laptop;notebook;pen",
        "shelf": "printer paper",
        "filing cabinet": "",
    },
    "bedroom": {
        "bed": "pillow",
        "nightstand": "alarm clock;Maya's phone",
        "closet": "suitcase;winter coat",
    },
    "bathroom": {
        "bathroom sink": "toothpaste;Maya's toothbrush;Leo's toothbrush",
        "laundry basket": "striped towel",
    },
    "hallway": {
        "shoe rack": "rain boots;sneakers",
        "coat rack": "umbrella",
        "key hook": "Maya's keys",
    },
    "garage": {"workbench": "hammer;flashlight;wrench", "toolbox": "tape measure;pliers"},
}
CLOSED = {"fridge", "cutlery drawer", "filing cabinet", "closet", "laundry basket", "toolbox"}
# A thing, and where it is from a day and an hour on.
MOVED = (
    ("passport", ("desk", (11, 0)), ("filing cabinet", (13, 0))),
    ("Leo's keys", ("kitchen table", (11, 0)), ("workbench", (14, 0))),
    ("backpack", ("sofa", (11, 0)), ("coat rack", (13, 0))),
    ("wallet", ("nightstand", (11, 0)), ("", (14, 12))),
    ("camera", ("shelf", (11, 0)), ("bed", (15, 12))),
    ("banana", ("counter", (14, 0))),
)


@cache
def make_service():
    """A home that was looked at in the morning and in the evening of five days."""
    memory = SceneGraphMemory(clock=Clock(START))
    ids = {}
    for room, places in ROOMS.items():
        number = memory.add_room(room)
        ids |= {place: memory.add_furniture(place, room=number) for place in places}
    always = {place: names for places in ROOMS.values() for place, names in places.items()}
    for day in range(11, 16):
        for hour in (8, 17 if day == 15 else 19):
            now = datetime(2026, 5, day, hour)
            memory.step(int((now - START).total_seconds() // 3600) - memory.time)
            at = {
                thing: [place for place, since in stays if since <= (day, hour)][-1:]
                for thing, *stays in MOVED
            }
            for place, names in always.items():
                seen = [*filter(None, names.split(";")), *(t for t in at if at[t] == [place])]
                relation = "in" if place in CLOSED else "onTop"
                memory.observe(ids[place], [Sighting(name, relation=relation) for name in seen])
            if (day, hour) == (15, 8):
                memory.step(4)
                memory.note_moved("camera", ids["bed"], by="Leo")
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(("said", "never", "speaker", "sentence"), ROWS)
def test_a_sentence_is_answered_right_or_asked_back(said, never, speaker, sentence):
    answer = make_service().ask(sentence, speaker=speaker)
    if said == "-":
        assert answer.status != "ok", answer.said
        return
    assert answer.status == "ok", answer.said
    told = answer.said.casefold()
    assert [words for words in said.split(";") if words not in told] == []
    assert [words for words in filter(None, never.split(";")) if words in told] == []

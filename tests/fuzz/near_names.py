"""Writes and searches of names that are nearly those of known things: nothing else may be meant."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.names.name import Name
from sgm.policies.heuristics import Bayesian
from simulator import SceneGraphMemory, Sighting

Rng = np.random.Generator
HEADS = ("mug", "ladle", "cable", "slipper", "kettle", "battery", "drawer", "insulin", "paper")
WORDS = ("left", "right", "red", "blue", "small", "large", "usb-a", "usb-c", "trash", "soda", "aa")
ENDS = ("", "", "", " 1", "_2", ".003", " 7a1f", "s")
LETTERS = "abcdefgilmnoprstu129é"


def make(folder: Path) -> None:
    """Write the seed that warms up."""
    (folder / "seed").write_text("0")


def change(folder: Path, rng: Rng) -> None:
    """Write another seed."""
    (folder / "seed").write_text(str(rng.integers(2**62)))


def use(folder: Path) -> None:
    """Write with near names; an AssertionError is a finding."""
    rng = np.random.default_rng(int((folder / "seed").read_text()))
    memory = SceneGraphMemory()
    room = memory.add_room("hall")
    for label in ("shelf", "desk"):
        memory.add_furniture(label, room)
    service = MemoryService(memory, Finder(Bayesian()), None)
    seen = list({_make_name(rng) for _ in range(int(rng.integers(1, 8)))})
    service.observe("shelf", [Sighting(name) for name in seen])
    for _ in range(10):
        known = seen[int(rng.integers(len(seen)))]
        _write(service, _spoil(known, rng), rng)
    for _ in range(3):
        _search(service, _spoil(seen[int(rng.integers(len(seen)))], rng), rng)


def _make_name(rng: Rng) -> str:
    words = [WORDS[int(rng.integers(len(WORDS)))]] if rng.random() < 0.6 else []
    head = HEADS[int(rng.integers(len(HEADS)))]
    return " ".join([*words, head]) + ENDS[int(rng.integers(len(ENDS)))]


def _spoil(name: str, rng: Rng) -> str:
    """Change, add, take or swap a letter or a word, or nothing."""
    kind, place = int(rng.integers(6)), int(rng.integers(len(name)))
    letter = LETTERS[int(rng.integers(len(LETTERS)))]
    if kind == 0:
        return name[:place] + letter + name[place + 1 :]
    if kind == 1:
        return name[:place] + letter + name[place:]
    if kind == 2:
        return (name[:place] + name[place + 1 :]) or name
    if kind == 3:
        return f"{WORDS[int(rng.integers(len(WORDS)))]} {name}"
    if kind == 4:
        return name.upper()
    return _make_name(rng)


def _search(service: MemoryService, name: str, rng: Rng) -> None:
    """Search for a name, and say what came of it; nothing may be noted of what is not meant."""
    memory = service.memory
    if not name.strip(" _.-"):
        return
    before = {thing: str(memory.history(thing)) for thing in memory.descriptions}
    meant = service.finder.resolve(memory, name).meant
    search = service.finder.search(memory, name)
    if search.next() is None:
        return
    kind = int(rng.integers(3))
    if kind == 0:
        search.found()
    elif kind == 1:
        search.not_found()
    else:
        other = _spoil(name, rng)
        if other.strip(" _.-"):
            is_found = search.seen([Sighting(other)], hidden=list(before))
            assert not is_found or _list_marks(name) <= _list_marks(other), (name, other)
        return
    for thing, was in before.items():
        assert thing in meant or str(memory.history(thing)) == was, (thing, name, kind)


def _list_marks(name: str) -> set[str]:
    """List sides and numbers of a name, of what is written together, too."""
    found = re.findall(r"\d+|left|right", name.casefold().replace("_", " "))
    return {mark.lstrip("0") for mark in found}


def _write(service: MemoryService, name: str, rng: Rng) -> None:
    memory = service.memory
    if not name.strip(" _.-"):
        return
    before = {
        thing: json.dumps([str(one) for one in memory.history(thing)])
        for thing in memory.descriptions
    }
    kind = int(rng.integers(4))
    if kind == 0:
        noted = service.forget(name, by="anna")
    elif kind == 1:
        noted = service.note_moved(name, "desk", "anna")
    elif kind == 2:
        noted = service.rename(name, "something of mine")
    else:
        noted = service.picked_up(name)
    if noted.status != "ok":
        assert noted.ask, noted
    for thing, was in before.items():
        if thing in memory.descriptions:
            told = json.dumps([str(one) for one in memory.history(thing)])
            is_kept = told == was
        else:
            is_kept = False
        assert is_kept or Name.read(thing).is_same(Name.read(name)), (thing, name, kind)
    if kind == 3 and noted.status == "ok":
        service.put_down(noted.thing, "shelf")
    if "something of mine" in memory.descriptions:
        service.forget("something of mine")
    if not memory.descriptions:
        service.observe("shelf", [Sighting("mug")])

"""Which place, room or thing a name means; or what to ask, where it means none or several."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from sgm.finder.answers import Status
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten, shorten_text
from sgm.names.name_matching import Resolution
from sgm.names.words import read_words

MOST_CANDIDATES = 5
_NUMBERED = re.compile(r".*\(place (\d{1,9})\)")  # as candidates of one name are distinguished
_MOST_NAME = 60  # characters of a name in a question


class Unclear(Exception):
    """A name that means none or several of what there is.

    Attributes:
        status: "ambiguous" or "unknown".
        ask: what to ask the user.
        candidates: what may be meant.
        thing: what the call was about; empty if it was about a place.
    """

    def __init__(
        self, status: Status, ask: str, candidates: tuple[str, ...], thing: str = ""
    ) -> None:
        """Say what to ask."""
        super().__init__(ask)
        self.status, self.ask, self.candidates, self.thing = status, ask, candidates, thing


def find_place(memory: SceneGraphMemory, place: int | str, thing: str = "") -> int:
    """Return the id of the place that is meant, by its id or by a name.

    Names are read as "white fridge in kitchen", "white fridge", or as `find_furniture` does. What
    is to be asked is about a thing, if one is given.

    Raises:
        Unclear: if that is none, or several.
        KeyError: if there is no place of that id.
        ValueError: if the name is none (`read_words`).
    """
    if not isinstance(place, str):
        memory.describe(place)  # checks it
        return int(place)
    words, layout = read_words("place", place), memory.layout
    names = {number: layout.describe(number) for number in layout.furniture}
    numbered = _NUMBERED.fullmatch(words)
    if numbered and int(numbered[1]) in names:
        return int(numbered[1])
    for called in (names, {number: row.description for number, row in layout.furniture.items()}):
        found = [number for number, name in called.items() if read_words("place", name) == words]
        if found:
            return _choose(found, names, thing)
    found = list(memory.find_furniture(place))
    if not found and " in " in words:
        what, _, room = words.rpartition(" in ")
        rooms = find_rooms(memory, room)
        among = memory.find_furniture(what)
        found = [number for number in among if layout.furniture[number].room in rooms]
    if found:
        return _choose(found, names, thing)
    rooms = [n for n, room in layout.rooms.items() if read_words("room", str(room)) == words]
    within = [names[number] for number in names if layout.furniture[number].room in rooms]
    if within:
        ask = f"{shorten(place, _MOST_NAME)} is a room. {_ask(within)}"
        raise Unclear("ambiguous", ask, tuple(within[:MOST_CANDIDATES]), thing)
    near = memory.resolve(place, among=list(names.values())).alternatives
    raise Unclear("unknown", _ask_unknown(place, near, "list_places"), near, thing)


def find_rooms(memory: SceneGraphMemory, room: str) -> list[int]:
    """Return the ids of the rooms that a name means.

    Raises:
        ValueError: if the name is none (`read_words`).
    """
    rooms = {number: str(own) for number, own in memory.layout.rooms.items()}
    words = read_words("room", room)
    found = [number for number, name in rooms.items() if read_words("room", name) == words]
    if not found:
        matches = memory.resolve(room, among=list(dict.fromkeys(rooms.values()))).matches
        found = [number for number, name in rooms.items() if name in matches]
    return found


def find_thing(
    memory: SceneGraphMemory, finder: Finder, thing: str, *, is_known: bool = False
) -> str:
    """Return the description or id of the one thing that is meant.

    Where it need not be known (`is_known`), a new name is one of its own.

    Raises:
        Unclear: if there are several, or none where one must be.
        ValueError: if the name is none (`read_words`).
    """
    resolution = finder.resolve(memory, thing)
    unclear = doubt(resolution, is_one=True)
    if unclear is not None and (resolution.matches or is_known):
        raise unclear
    if not resolution.matches:
        return thing
    own = resolution.matches[0]
    ids = memory.list_ids(own)
    if len(ids) > 1:
        told = [f"{own} {number}" for number in ids]
        raise Unclear("ambiguous", _ask(told), ids[:MOST_CANDIDATES], thing)
    return own


def doubt(resolution: Resolution, *, is_one: bool = False) -> Unclear | None:
    """Return what to ask where a question means different things, or nothing; None if it is clear.

    Several things of one name are a doubt where the question is about one (`is_one`), else not.
    """
    matches, thing = resolution.matches, resolution.question
    if resolution.is_ambiguous or (is_one and len(matches) > 1):
        ask = resolution.ask_back or _ask(matches)
        return Unclear("ambiguous", ask, matches[:MOST_CANDIDATES], thing)
    if matches:
        return None
    near = resolution.alternatives[:MOST_CANDIDATES]
    return Unclear("unknown", _ask_unknown(thing, near, "list_things"), near, thing)


def tell_doubt(unclear: Unclear | None) -> dict[str, Any]:
    """Return the fields of an answer that say what to ask; without anything unclear, nothing."""
    if unclear is None:
        return {"status": "ok", "ask": "", "candidates": ()}
    return {"status": unclear.status, "ask": unclear.ask, "candidates": unclear.candidates}


def ask_room(memory: SceneGraphMemory, room: str, found: Sequence[int]) -> Unclear:
    """Return what to ask where a name means several rooms, or none."""
    labels = tuple(dict.fromkeys(map(str, memory.layout.rooms.values())))[:MOST_CANDIDATES]
    name = shorten(room, _MOST_NAME)
    if found:
        ask = f"Several rooms are called {name}. Name one that has no namesake."
        return Unclear("ambiguous", ask, labels)
    return Unclear("unknown", f"No room is called {name}.", labels)


def _choose(found: Sequence[int], names: dict[int, str], thing: str) -> int:
    if len(found) == 1:
        return found[0]
    own = [names[number] for number in found]
    told = [
        name if own.count(name) == 1 else f"{name} (place {number})"
        for number, name in zip(found, own, strict=True)
    ]
    raise Unclear("ambiguous", _ask(told), tuple(told[:MOST_CANDIDATES]), thing)


def _ask(names: Sequence[str]) -> str:
    shown = [f"the {shorten_text(name, _MOST_NAME)}" for name in names[:MOST_CANDIDATES]]
    return f"Do you mean {' or '.join(shown)}?"


def _ask_unknown(name: str, near: Sequence[str], call: str) -> str:
    nothing = f"Nothing is known as {shorten(name, _MOST_NAME)}."
    return f"{nothing} {_ask(near)}" if near else f"{nothing} {call} tells what there is."

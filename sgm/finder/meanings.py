"""Which place, room or thing a name means; or what to ask, where it means none or several."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal

from sgm.finder.answers import Status
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten, shorten_text
from sgm.names.name import Name
from sgm.names.resolution import Resolution
from sgm.names.words import read_words

MOST_CANDIDATES = 5
MayBeNew = Literal["never", "if_unlike", "always"]
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


def find_place(
    memory: SceneGraphMemory, place: int | str, thing: str = "", *, acts: bool = False
) -> int:
    """Return the id of the place that is meant, by its id or by a name.

    Names are read as "white fridge in kitchen", "kitchen fridge", "white fridge" or "fridge". For a
    call that only reads, as `find_furniture` does, too. What is to be asked is about a thing, if
    one is given.

    Args:
        memory: of the home.
        place: id or name.
        thing: what the call is about.
        acts: whether the call writes: it takes an exact name (`resolve_exact`).

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
    found = [called for called in memory.find_called(Name.read(place, "place")) if called in names]
    if found:
        return _choose(found, names, thing)
    likely = list(memory.find_furniture(place))
    if not likely and " in " in words:
        furniture_words, _, room = words.rpartition(" in ")
        rooms = find_rooms(memory, room)
        among = memory.find_furniture(furniture_words)
        likely = [number for number in among if layout.furniture[number].room in rooms]
    if likely and not acts:
        return _choose(likely, names, thing)
    rooms = find_rooms(memory, place, acts=True)
    within = [names[number] for number in names if layout.furniture[number].room in rooms]
    if within and not likely:
        ask = f"{shorten(place, _MOST_NAME)} is a room. {_ask(within)}"
        raise Unclear("ambiguous", ask, tuple(within[:MOST_CANDIDATES]), thing)
    full_names = {names[number]: node.description for number, node in layout.furniture.items()}
    resolution = memory.resolve_exact(place, among=list(full_names.values()))
    spelled = [name for name, described in full_names.items() if described in resolution.doubtful]
    candidates = tuple(dict.fromkeys([*(names[number] for number in likely), *spelled]))
    if candidates:
        told = candidates[:MOST_CANDIDATES]
        raise Unclear("ambiguous", _ask_unknown(place, told, "list_places"), told, thing)
    near = memory.resolve(place, among=list(names.values())).alternatives
    raise Unclear("unknown", _ask_unknown(place, near, "list_places"), near, thing)


def find_rooms(memory: SceneGraphMemory, room: str, *, acts: bool = False) -> list[int]:
    """Return the ids of the rooms that a name means; of exactly that name, if the call writes.

    Raises:
        ValueError: if the name is none (`read_words`).
    """
    rooms = {number: str(label) for number, label in memory.layout.rooms.items()}
    name = Name.read(room, "room")
    found = [number for number, label in rooms.items() if Name.read(label).is_same(name)]
    if not found and not acts:
        matches = memory.resolve(room, among=list(dict.fromkeys(rooms.values()))).matches
        found = [number for number, label in rooms.items() if label in matches]
    return found


def find_thing(memory: SceneGraphMemory, thing: str, may_be_new: MayBeNew = "never") -> str:
    """Return the description or id of the one thing that a call acts on.

    It is exactly of that name (`resolve_exact`), or has that id.

    Args:
        memory: of the home.
        thing: name or id.
        may_be_new: whether another name is a new thing: never, where nothing is known that may be
            meant, or always.

    Raises:
        Unclear: if there are several, or none where one must be.
        ValueError: if the name is none (`read_words`).
    """
    found = memory.resolve_exact(thing)
    if not found.matches:
        if may_be_new == "always" or (may_be_new == "if_unlike" and not found.doubtful):
            return thing
        near = found.doubtful[:MOST_CANDIDATES]
        if near:
            raise Unclear("ambiguous", _ask(near), near, thing)
        near = found.alternatives[:MOST_CANDIDATES]
        raise Unclear("unknown", _ask_unknown(thing, near, "list_things"), near, thing)
    if len(found.matches) > 1:
        raise Unclear("ambiguous", _ask(found.matches), found.matches[:MOST_CANDIDATES], thing)
    match = found.matches[0]
    ids = memory.list_ids(match)
    if len(ids) > 1:
        told = [f"{match} {number}" for number in ids]
        raise Unclear("ambiguous", _ask(told), ids[:MOST_CANDIDATES], thing)
    return match


def doubt(resolution: Resolution) -> Unclear | None:
    """Return what to ask where a question means different things, or nothing; None if it is clear.

    Several things of one name are no doubt: a question is about all of them.
    """
    matches, thing = resolution.matches, resolution.question
    if resolution.is_ambiguous:
        told = (matches or resolution.doubtful)[:MOST_CANDIDATES]
        ask = resolution.ask_back if matches else _ask(told)
        return Unclear("ambiguous", ask, told, thing)
    if matches:
        return None
    near = resolution.alternatives[:MOST_CANDIDATES]
    return Unclear("unknown", _ask_unknown(thing, near, "list_things"), near, thing)


def tell_doubt(unclear: Unclear | None) -> dict[str, Any]:
    """Return the fields of an answer that say what to ask; without anything unclear, nothing."""
    if unclear is None:
        return {"status": "ok", "ask": "", "candidates": ()}
    return {"status": unclear.status, "ask": unclear.ask, "candidates": unclear.candidates}


def ask_which(names: Sequence[str], thing: str) -> Unclear:
    """Return what to ask about things that may be what was asked for, and may be others."""
    return Unclear("ambiguous", _ask(names), tuple(names[:MOST_CANDIDATES]), thing)


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
    chosen = [names[number] for number in found]
    told = [
        name if chosen.count(name) == 1 else f"{name} (place {number})"
        for number, name in zip(found, chosen, strict=True)
    ]
    raise Unclear("ambiguous", _ask(told), tuple(told[:MOST_CANDIDATES]), thing)


def _ask(names: Sequence[str]) -> str:
    shown = [f"the {shorten_text(name, _MOST_NAME)}" for name in names[:MOST_CANDIDATES]]
    return f"Do you mean {' or '.join(shown)}?"


def _ask_unknown(name: str, near: Sequence[str], call: str) -> str:
    nothing = f"Nothing is known as {shorten(name, _MOST_NAME)}."
    return f"{nothing} {_ask(near)}" if near else f"{nothing} {call} tells what there is."

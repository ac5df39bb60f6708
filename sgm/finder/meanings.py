"""Which place, room or thing a name means; or what to ask, where it means none or several."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

from sgm.finder.answers import Status
from sgm.finder.said_places import find_said_places, list_shown, narrow
from sgm.layout.layout import RoomId
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.names.asking import MOST_NAME, Asking, make_asking
from sgm.names.name import Name
from sgm.names.phrase import make_phrase_reader
from sgm.names.resolution import Resolution
from sgm.names.words import normalize, read_words

MOST_CANDIDATES = 5
MayBeNew = Literal["never", "if_unlike", "always"]
_MOST_SEEN = 200  # places of things of one name
# As candidates of one name are distinguished.
_NUMBERED = re.compile(r".*\(place (\d{1,9})\)")
_NUMBERED_ROOM = re.compile(r".*\(room (\d{1,9})\)")


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
        try:
            memory.describe(place)
        except KeyError:  # names functions of Python, which other clients do not have
            raise KeyError(
                f"furniture must be an id or a name, got {shorten(place)}. list_places has both."
            ) from None
        return int(place)
    words, layout = read_words("place", place), memory.layout
    names = {number: layout.describe(number) for number in layout.furniture}
    numbered = _NUMBERED.fullmatch(words)
    if numbered and int(numbered[1]) in names:
        return int(numbered[1])
    found = [called for called in memory.find_called(Name.read(place, "place")) if called in names]
    if found:
        return _choose(found, names, thing, make_asking(memory.language))
    likely = list(memory.find_furniture(place))
    if not likely:
        likely = _find_in_room(memory, words)
    asking = make_asking(memory.language)
    if likely and not acts:
        return _choose(likely, names, thing, asking)
    rooms = find_rooms(memory, place, acts=True)
    within = [names[number] for number in names if layout.furniture[number].room in rooms]
    if within and not likely:
        is_room = asking.say("is a room", name=shorten(place, MOST_NAME))
        ask = f"{is_room} {asking.ask_which(within[:MOST_CANDIDATES])}"
        raise Unclear("ambiguous", ask, tuple(within[:MOST_CANDIDATES]), thing)
    full_names = {names[number]: node.description for number, node in layout.furniture.items()}
    resolution = memory.resolve_exact(place, among=list(full_names.values()))
    exact = [number for number in names if full_names[names[number]] in resolution.matches]
    if exact and not resolution.where:  # in the words of another language
        return _choose(exact, names, thing, asking)
    spelled = [name for name, described in full_names.items() if described in resolution.doubtful]
    candidates = tuple(dict.fromkeys([*(names[number] for number in likely), *spelled]))
    if candidates:
        told = candidates[:MOST_CANDIDATES]
        raise Unclear("ambiguous", asking.ask_unknown(place, told, "list_places"), told, thing)
    near = memory.resolve(place, among=list(names.values())).alternatives
    raise Unclear("unknown", asking.ask_unknown(place, near, "list_places"), near, thing)


def _find_in_room(memory: SceneGraphMemory, words: str) -> list[int]:
    """Return the ids of the furniture of a name in a room, "the fridge in the kitchen"."""
    phrases = make_phrase_reader(memory.language)
    phrase = phrases.read(words)
    if not phrase.where or not phrase.name:
        return []
    rooms = find_rooms(memory, phrases.split_where(phrase.where)[1])
    furniture = memory.layout.furniture
    among = memory.find_furniture(phrase.name)
    return [number for number in among if furniture[number].room in rooms]


def find_rooms(memory: SceneGraphMemory, room: str, *, acts: bool = False) -> list[int]:
    """Return the ids of the rooms that a name means; of exactly that name, if the call writes.

    Raises:
        ValueError: if the name is none (`read_words`).
    """
    rooms = {int(number): str(label) for number, label in memory.layout.rooms.items()}
    numbered = _NUMBERED_ROOM.fullmatch(read_words("room", room))
    if numbered and int(numbered[1]) in rooms:
        return [int(numbered[1])]
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
            meant, or always. No name is what has words that name nothing: "it", "not the red mug".

    Raises:
        Unclear: if there are several, or none where one must be.
        ValueError: if the name is none (`read_words`).
    """
    (named,) = find_things(memory, thing, may_be_new, most=1)
    return named.thing


class NamedThing(NamedTuple):
    """A thing that a call acts on, and where it is, by the words of the call.

    Attributes:
        thing: its description or id.
        was_at: id of the place that the name says, "the mug on the desk"; None without one.
    """

    thing: str
    was_at: int | None = None


def find_things(
    memory: SceneGraphMemory,
    things: str,
    may_be_new: MayBeNew = "never",
    speaker: str = "",
    most: int = MOST_CANDIDATES,
) -> list[NamedThing]:
    """Return the things that a call acts on, "the keys and the wallet": each as `find_thing` does.

    Args:
        memory: of the home.
        things: names or ids.
        may_be_new: as in `find_thing`.
        speaker: who says "my"; empty if that is not known.
        most: things that the call may act on.

    Raises:
        Unclear: if one of them is, or there are more.
        ValueError: if a name is none (`read_words`).
    """
    asking = make_asking(memory.language)
    sentence = memory.read_sentence(things, speaker)
    if sentence.kind != "thing":
        raise Unclear(
            "ambiguous", asking.say("no name", words=shorten(things, MOST_NAME)), (), things
        )
    if sentence.time is not None:
        raise Unclear("ambiguous", asking.tell_unused((sentence.time.words,)), (), things)
    if len(sentence.things) > most:
        ask = asking.say("several", names=asking.list_names(sentence.things))
        raise Unclear("ambiguous", ask, sentence.things[:MOST_CANDIDATES], things)
    found: list[NamedThing] = []
    named = sentence.things or (things,)
    if named == (normalize(things),):  # as it is written
        named = (asking.strip_article(things) if asking.is_translated else things,)
    for thing in named:
        found += _find_named(memory, thing, may_be_new, asking, most)
    return found


def _find_named(
    memory: SceneGraphMemory, thing: str, may_be_new: MayBeNew, asking: Asking, most: int
) -> list[NamedThing]:
    """Return what one name means, "both mugs" both of them, "all mugs" each."""
    found = memory.resolve_exact(thing)
    if found.unused:
        near = found.doubtful[:MOST_CANDIDATES]
        told = [asking.tell_unused(found.unused), *([asking.ask_which(near)] if near else [])]
        raise Unclear("ambiguous", " ".join(told), near, thing)
    if found.quantity:
        return _find_quantity(memory, thing, found.quantity, asking, most)
    was_at = _find_said_place(memory, found, thing, asking)
    if found.where and not found.matches:  # "the mug on the counter", where two are
        meant = narrow(memory, memory.resolve(thing))
        if meant.matches:
            near = meant.matches[:MOST_CANDIDATES]
            raise Unclear("ambiguous", meant.contradiction or asking.ask_which(near), near, thing)
    if not found.matches:
        phrase = make_phrase_reader(memory.language).read(thing)
        is_name = not phrase.excluded
        is_new = may_be_new == "always" or (may_be_new == "if_unlike" and not found.doubtful)
        if is_name and is_new:
            return [NamedThing(thing=phrase.name if phrase.where else thing, was_at=was_at)]
        near = found.doubtful[:MOST_CANDIDATES]
        if near:
            raise Unclear("ambiguous", asking.ask_which(near), near, thing)
        near = found.alternatives[:MOST_CANDIDATES]
        raise Unclear("unknown", asking.ask_unknown(thing, near, "list_things"), near, thing)
    if len(found.matches) > 1:
        ask = asking.ask_which(found.matches[:MOST_CANDIDATES])
        raise Unclear("ambiguous", ask, found.matches[:MOST_CANDIDATES], thing)
    match = found.matches[0]
    ids = memory.list_ids(match)
    if len(ids) > 1:
        told = [f"{match} {number}" for number in ids[:MOST_CANDIDATES]]
        raise Unclear("ambiguous", asking.ask_which(told), ids[:MOST_CANDIDATES], thing)
    return [NamedThing(thing=match, was_at=was_at)]


def _find_quantity(
    memory: SceneGraphMemory, thing: str, quantity: str, asking: Asking, most: int
) -> list[NamedThing]:
    """Return all things of a kind where as many are said: both of two, or every one."""
    meant = memory.resolve(thing)
    number = len(meant.matches)
    is_all = 1 <= number <= most and meant.has_quantity
    if not is_all or meant.is_ambiguous or not meant.is_sure or most < number:
        near = (meant.matches or meant.doubtful)[:MOST_CANDIDATES]
        ask = f"{asking.say('all', number=number)} {asking.ask_which(near) if near else ''}".strip()
        raise Unclear("ambiguous" if near else "unknown", ask, near, thing)
    return [NamedThing(thing=match) for match in meant.matches]


def _find_said_place(
    memory: SceneGraphMemory, found: Resolution, thing: str, asking: Asking
) -> int | None:
    """Return the place that a name says the thing is at: from there it is taken."""
    if not found.where:
        return None
    if found.is_not_there:
        raise Unclear("ambiguous", asking.tell_unused((found.where,)), found.matches, thing)
    places = find_said_places(memory, found.where)
    if not places:
        words = make_phrase_reader(memory.language).split_where(found.where)[1]
        raise Unclear("ambiguous", asking.say("no place", name=words), (), thing)
    holding = set[int]().union(*list_shown(memory, found.matches, places).values())
    if found.matches and not holding:
        narrowed = narrow(memory, found)
        raise Unclear("ambiguous", narrowed.contradiction, found.matches, thing)
    among = sorted(holding & set(places)) or places
    return among[0] if len(among) == 1 else None


def doubt(resolution: Resolution) -> Unclear | None:
    """Return what to ask where a question means different things, or nothing; None if it is clear.

    Several things of one name are no doubt: a question is about all of them.
    """
    matches, thing = resolution.matches, resolution.question
    if resolution.is_ambiguous:
        told = (resolution.things or matches or resolution.doubtful)[:MOST_CANDIDATES]
        return Unclear("ambiguous", resolution.ask_back, told, thing)
    if matches:
        return None
    near = resolution.alternatives[:MOST_CANDIDATES]
    asking = make_asking(resolution.language)
    return Unclear("unknown", asking.ask_unknown(thing, near, "list_things"), near, thing)


def tell_doubt(unclear: Unclear | None) -> dict[str, Any]:
    """Return the fields of an answer that say what to ask; without anything unclear, nothing."""
    if unclear is None:
        return {"status": "ok", "ask": "", "candidates": ()}
    return {"status": unclear.status, "ask": unclear.ask, "candidates": unclear.candidates}


def ask_which(names: Sequence[str], thing: str, language: str) -> Unclear:
    """Return what to ask about things that may be what was asked for, and may be others."""
    ask = make_asking(language).ask_which(names[:MOST_CANDIDATES])
    return Unclear("ambiguous", ask, tuple(names[:MOST_CANDIDATES]), thing)


def ask_room(memory: SceneGraphMemory, room: str, found: Sequence[int]) -> Unclear:
    """Return what to ask where a name means several rooms, or none."""
    asking = make_asking(memory.language)
    rooms = memory.layout.rooms
    if found:
        told = tuple(f"{rooms[RoomId(n)]} (room {n})" for n in found[:MOST_CANDIDATES])
        return Unclear("ambiguous", asking.ask_which(told), told)
    labels = tuple(dict.fromkeys(map(str, rooms.values())))[:MOST_CANDIDATES]
    return Unclear("unknown", asking.say("no room", name=shorten(room, MOST_NAME)), labels)


def _choose(found: Sequence[int], names: dict[int, str], thing: str, asking: Asking) -> int:
    if len(found) == 1:
        return found[0]
    chosen = [names[number] for number in found]
    told = [
        name if chosen.count(name) == 1 else f"{name} (place {number})"
        for number, name in zip(found, chosen, strict=True)
    ][:MOST_CANDIDATES]
    raise Unclear("ambiguous", asking.ask_which(told), tuple(told), thing)

"""Places in a question: "the mug in the sink" is the one that is there, or none is known there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import SeenAt
from sgm.names.asking import make_asking
from sgm.names.modifiers import is_property, spell
from sgm.names.name import Name
from sgm.names.phrase import make_phrase_reader
from sgm.names.resolution import Resolution
from sgm.names.words import make_key, normalize

_MOST_SEEN = 200  # places of the things that are asked for


def find_said_places(memory: SceneGraphMemory, where: str) -> list[int]:
    """Return the ids of the furniture that "in the sink" or "in the kitchen" means; none is empty.

    Raises:
        ValueError: if it is no name (`read_words`).
    """
    phrases = make_phrase_reader(memory.language)
    _, words = phrases.split_where(where)
    return find_named_places(memory, words or where)


def find_named_places(memory: SceneGraphMemory, words: str) -> list[int]:
    """Return the ids of the furniture of a name, of a room, or of a name in a room.

    A name that a room has is that of the room, not of "floor of kitchen" or "kitchen table".
    """
    layout = memory.layout
    name = Name.read(words, "place")
    found = [called for called in memory.find_called(name) if called in layout.furniture]
    rooms = {n for n, label in layout.rooms.items() if Name.read(str(label)).is_same(name)}
    if not found and not rooms:
        found = _find_likely(memory, words)
    if found:
        return found
    if not rooms:
        labels = list(dict.fromkeys(map(str, layout.rooms.values())))
        meant = memory.resolve(words, among=labels)
        if meant.is_sure and not meant.says_less:
            rooms = {n for n, label in layout.rooms.items() if str(label) in meant.matches}
    if rooms:
        return [n for n, node in layout.furniture.items() if node.room in rooms]
    phrases = make_phrase_reader(memory.language)
    phrase = phrases.read(words)
    if not phrase.where or not phrase.name:
        return []
    within = find_named_places(memory, phrases.split_where(phrase.where)[1])
    return [n for n in find_named_places(memory, phrase.name) if n in within]


def _find_likely(memory: SceneGraphMemory, words: str) -> list[int]:
    """Return the ids of the furniture of a name all of whose words are used; no "sink red"."""
    furniture = memory.layout.furniture
    meant = memory.resolve(words, among=[node.description for node in furniture.values()])
    last = words.split()[-1]
    if meant.how == "part of the name":  # "sofa like"
        return []
    if meant.unused or meant.where or (meant.says_less and is_property(spell(last))):
        return []
    if not meant.matches and words == last:  # "the drawer", where a desk drawer is the only one
        key = make_key([last])
        ending = [
            n
            for n, node in furniture.items()
            if make_key(normalize(node.description).split()[-1:]) == key
        ]
        return ending if len(ending) == 1 else []
    return [n for n, node in furniture.items() if node.description in meant.matches]


def narrow(memory: SceneGraphMemory, resolution: Resolution) -> Resolution:
    """Choose, of the things that a question means, those that are at the place that it names.

    Where none of them is known there, the resolution says so (`contradiction`); a place that there
    is not is a word that nothing was made of (`unused`).
    """
    places = tuple(find_said_places(memory, resolution.where))
    if not places and resolution.is_soft:
        return resolution
    if not places:
        return replace(resolution, unused=(*resolution.unused, resolution.where))
    if not resolution.matches:
        return replace(resolution, places=places)
    seen, _ = memory.list_seen(resolution.matches, None, _MOST_SEEN)
    shown = list_shown(memory, resolution.matches, places)
    present = {name for name, at in shown.items() if at}
    if resolution.is_not_there:
        others = {thing for thing, at in seen if at.is_there and at.furniture not in places}
        kept = [name for name in resolution.matches if name not in present or name in others]
        if kept:  # of several of one name, those that are elsewhere come first
            away = {at.furniture for thing, at in seen if thing in kept and at.is_there}
            return _keep(
                resolution, kept, tuple(n for n in away if n is not None and n not in places)
            )
        return replace(resolution, contradiction=_tell_elsewhere(memory, resolution, seen, places))
    kept = [name for name in resolution.matches if name in present]
    if kept:
        return _keep(resolution, kept, places)
    told = _tell_elsewhere(memory, resolution, seen, places)
    return replace(resolution, contradiction=told)


def list_shown(
    memory: SceneGraphMemory, names: Sequence[str], places: Sequence[int]
) -> dict[str, set[int]]:
    """Return at which of some places each description or id is by the last looks.

    What looks of one time step show at two places may be two things: it is at both.
    """
    shown: dict[str, set[int]] = {}
    for name in names:
        shown[name] = {place for place in places if memory.list_named(name, place=place)}
        if len(shown[name]) < len(places):
            shown[name] |= _find_last_shown(memory, name).intersection(places)
    return shown


def _find_last_shown(memory: SceneGraphMemory, name: str) -> set[int]:
    """Return where the last time step that showed a thing did, and says nothing else of it."""
    events = memory.history(name)
    last = max((event.time for event in events if event.kind == "seen"), default=None)
    kinds: dict[int, set[str]] = {}
    for event in events:
        if event.time == last and event.furniture is not None:
            kinds.setdefault(event.furniture, set()).add(event.kind)
    return {furniture for furniture, said in kinds.items() if said == {"seen"}}


def _keep(resolution: Resolution, kept: Sequence[str], places: tuple[int, ...]) -> Resolution:
    groups = [tuple(name for name in group if name in kept) for group in resolution.readings]
    return replace(
        resolution,
        matches=tuple(kept),
        readings=tuple(group for group in groups if group),
        places=places,
    )


def _tell_elsewhere(
    memory: SceneGraphMemory,
    resolution: Resolution,
    seen: Sequence[tuple[str, SeenAt]],
    places: Sequence[int],
) -> str:
    """Say "None is known in the sink; the mug is at the counter in kitchen."."""
    asking = make_asking(memory.language)
    where = resolution.where
    if resolution.is_soft:  # a room before a name, in the words of the table
        link, _, room = where.partition(" ")
        where = f"{link} {asking.translate(room)}"
    if resolution.is_not_there:
        return asking.say("only there", place=where)
    nothing = asking.say("not there", place=where)
    for thing, at in seen:
        if at.furniture in memory.layout.furniture and at.furniture not in places:
            where = memory.describe(int(at.furniture))
            sentence = "seen elsewhere" if at.is_there else "was elsewhere"
            return f"{nothing} {asking.tell(sentence, thing, where=asking.say_the(where))}"
    return nothing

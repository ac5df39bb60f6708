"""What people call things at a place, where a detector goes on to call them otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TypeAlias

from sgm.memory.sighting import Sighting
from sgm.names.name import Name
from sgm.names.words import read_words

# By words of what detectors say, and furniture id: what the thing is called there.
GivenNames: TypeAlias = Mapping[tuple[str, int], str]


def name_seen(
    given: GivenNames,
    furniture: int,
    seen: Iterable[Sighting],
    is_there: Callable[[Name], bool],
) -> tuple[Sighting, ...]:
    """Return what a detector shows at furniture by the names that people have given to it.

    Args:
        given: names that people have given.
        furniture: id of the place.
        seen: as the detector calls it.
        is_there: whether a thing that has no id and is called so is held to be there. Of two
            sightings one is of that thing then.
    """
    called = _find_called(given, furniture)
    if not called:
        return tuple(seen)
    named: list[Sighting] = []
    for sighting in seen:
        key = sighting.name.key
        if not sighting.id and key in called:
            name = called[key] if not is_there(sighting.name) else called.pop(key)
            sighting = replace(sighting, description=name, owner=None)
        named.append(sighting)
    return tuple(named)


def name_hidden(given: GivenNames, furniture: int, hidden: Iterable[Name]) -> tuple[Name, ...]:
    """Return what was out of view by the names that people have given, and as it was called."""
    called = _find_called(given, furniture)
    names = {name.key: name for name in hidden}
    for key in [key for key in names if key in called]:
        name = Name.read(called[key])
        names.setdefault(name.key, name)
    return tuple(names.values())


def rename_given(given: GivenNames, before: str, name: str, places: Iterable[int]) -> GivenNames:
    """Return the names with one more: what was called `before` at places is called otherwise.

    Where what detectors say is called `before`, it is called otherwise from now on, or, where that
    is what they say, by no other name.
    """
    is_before, called = Name.read(before).key, dict[tuple[str, int], str]()
    left = set(places)
    for (said, furniture), now in given.items():
        if Name.read(now).key == is_before:
            left.discard(furniture)
            now = name
        if Name.read(said).key != Name.read(now).key:
            called[said, furniture] = now
    words = read_words("description", before)
    return {(words, furniture): name for furniture in sorted(left)} | called


def _find_called(given: GivenNames, furniture: int) -> dict[tuple[str, ...], str]:
    """Return what is called otherwise at furniture, by the key of what detectors say."""
    return {Name.read(words).key: name for (words, at), name in given.items() if at == furniture}

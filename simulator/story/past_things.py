"""Which thing of a memory file a name meant at the time, whatever it was called otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from sgm.memory.memory_event import MemoryEvent
from sgm.memory.thing import ThingName
from sgm.names.words import read_name
from sgm.store.event_kinds import (
    LAYOUT,
    LOOK,
    QUESTION,
    SETTINGS,
    STATEMENT,
    TIME,
    get_by_kind,
    list_kinds,
)

_Key = tuple[str, ...] | str  # by which a thing is known: its words, or its id


class PastThings:
    """Follows the things of a file over renames, merges and splits; a thing is a number.

    Attributes:
        seen: numbers of the things that each look showed, look by look.
        spoken_of: number of the thing that each statement was about, -1 for none.
    """

    def __init__(self) -> None:
        """Start without things."""
        self.seen: list[list[int]] = []
        self.spoken_of: list[int] = []
        self._furniture: list[int] = []  # of each look
        self._number_of: dict[_Key, int] = {}
        self._names: list[list[tuple[int, str]]] = []  # of each thing, since which time step
        self._same_as: dict[int, int] = {}

    def note_look(self, time: int, furniture: int, seen: Iterable[tuple[Any, ...]]) -> None:
        """Note what a look at a place showed: the arguments of each sighting, as in events."""
        self._furniture.append(furniture)
        ids = ((sighting[0], sighting[4] or "" if len(sighting) > 4 else "") for sighting in seen)
        self.seen.append([self._find(time, description, number) for description, number in ids])

    def note_statement(self, time: int, name: ThingName | None) -> None:
        """Note of which thing something was said; None where it was about furniture."""
        number = -1 if name is None else self._find(time, name.description, name.id)
        self.spoken_of.append(number)

    def note_change(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        """Note an event that changes what things are called, or which of them are one.

        `furniture` are the ids of the places, by those of the file.
        """
        get_by_kind(CHANGES, line.kind, __name__)(self, line, furniture)

    def _rename(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        number, name = self._find_named(line), line.values["name"]
        self._names[number].append((line.time, name))
        if not line.values.get("id"):
            del self._number_of[read_name(line.values["description"])]
            self._number_of[read_name(name)] = number

    def _merge(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        number, other = self._find_named(line), line.values["other"]
        self._same_as[self._find(line.time, other.description, other.id)] = number

    def _split(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        number = self._find_named(line)
        if self._same_as.pop(number, None) is None:  # it stands for others: split all
            self._same_as = {n: root for n, root in self._same_as.items() if root != number}

    def _split_off(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        """Let what was seen of the thing at the place so far be another thing."""
        number, place = self._find_named(line), furniture[line.values["furniture"]]
        new = self._find(line.time, line.values["name"], "")
        for looked, seen in zip(self._furniture, self.seen, strict=True):
            if looked == place:
                seen[:] = [new if number == thing else thing for thing in seen]

    def _find_named(self, line: MemoryEvent) -> int:
        name = ThingName.from_json(line.values)
        return self._find(line.time, name.description, name.id)

    def _pass(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        """Note nothing."""

    def find(self, names: Iterable[str], step: int) -> frozenset[int]:
        """Return the numbers of the things of some names, and of all that are one with them.

        Names are ids, or what the things are called at the time step.
        """
        words = {read_name(name) for name in names}
        numbers = {self._number_of[name] for name in names if name in self._number_of}
        numbers |= {
            n for n in range(len(self._names)) if read_name(self._get_called(n, step)) in words
        }
        roots = {self._get_root(number) for number in numbers}
        return frozenset(n for n in range(len(self._names)) if self._get_root(n) in roots)

    def get_name(self, things: frozenset[int], step: int) -> str | None:
        """Return what the one thing that `find` found was called at a time step; None if as now."""
        roots = {self._get_root(number) for number in things}
        number = roots.pop() if len(roots) == 1 else None
        if number is None or len(self._names[number]) == 1:
            return None
        return self._get_called(number, step)

    def _get_called(self, number: int, step: int) -> str:
        """Return what a thing was called at a time step, or at first."""
        called = self._names[number]
        return next((name for time, name in reversed(called) if time <= step), called[0][1])

    def _find(self, time: int, description: str, number: str) -> int:
        """Return the number of a thing by its id or, without one, its words; a new one at first."""
        key: _Key = number or read_name(description)
        if key not in self._number_of:
            self._number_of[key] = len(self._names)
            self._names.append([(time, description)])
        return self._number_of[key]

    def _start(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        """Go on with a memory, which says itself what is one."""
        time, content = line.time, line.values["memory"]
        same_as = np.asarray(content.tables["objects"]["same_as"]).tolist()
        numbers = [self._find(time, thing.description, thing.id) for thing in content.things]
        self._same_as = {
            numbers[number]: numbers[root] for number, root in enumerate(same_as) if root >= 0
        }

    def _get_root(self, number: int) -> int:
        for _ in self._same_as:  # links lead to links where things were merged again and again
            number = self._same_as.get(number, number)
        return number


# What each kind changes of names, or of which things are one.
CHANGES: Mapping[str, Callable[[PastThings, MemoryEvent, Mapping[int, int]], None]] = {
    "start": PastThings._start,
    "rename": PastThings._rename,
    "merge": PastThings._merge,
    "split": PastThings._split,
    "split_off": PastThings._split_off,
    "remove_object": PastThings._split,
    **dict.fromkeys(
        list_kinds(LAYOUT, LOOK, STATEMENT, QUESTION, TIME, SETTINGS), PastThings._pass
    ),
}

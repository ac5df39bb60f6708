"""Where things were at a time that has passed, by what the memory keeps of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sgm.belief import compute_stay
from sgm.memory.scene_graph_memory import SceneGraphMemory


@dataclass(frozen=True, slots=True)
class WasAt:
    """A place where a thing may have been at a time.

    Attributes:
        thing: its description.
        furniture: id of the place; None with the robot, or if it was removed.
        relation: such as "in" or "onTop" it; None without a place.
        probability: that it was there.
        time: time step of what is known that says so: the nearest one.
        by: who said so; empty for looks.
    """

    thing: str
    furniture: int | None
    relation: str | None
    probability: float
    time: int
    by: str


@dataclass(frozen=True, slots=True)
class _Known:
    """Where a thing is known to have been at a time step; attributes as of `WasAt`."""

    time: int
    furniture: int | None
    relation: str | None
    by: str
    sure: float


def find_past_places(
    memory: SceneGraphMemory, thing: str, begin: int, end: int
) -> tuple[WasAt, ...]:
    """Say where a thing was from a time step to another, the likeliest place first.

    A sighting or statement in that time says so. Else the last one before and the first one after
    it do, each as sure as things stay where they are for that long (`compute_stay`); where both
    name one place, at least one of them has to be right. Nothing is said about the time before
    a thing was first seen.
    """
    known = sorted(_list_known(memory, thing), key=lambda where: where.time)
    within = [where for where in known if begin <= where.time <= end]
    if within:
        last = within[-1]
        return (_tell(thing, last, last.sure),)
    before = [where for where in known if where.time < begin][-1:]
    after = [where for where in known if where.time > end][:1]
    if not before:
        return ()
    gaps = [begin - where.time for where in before] + [where.time - end for where in after]
    stay = compute_stay(memory.batch, np.array(gaps)).tolist()
    first = before[0]
    if not after:
        return (_tell(thing, first, stay[0] * first.sure),)
    later = after[0]
    if (first.furniture, first.relation) == (later.furniture, later.relation):
        both = 1 - (1 - stay[0] * first.sure) * (1 - stay[1] * later.sure)
        return (_tell(thing, first if gaps[0] <= gaps[1] else later, both),)
    total = stay[0] + stay[1]
    apart = 1 - (1 - stay[0]) * (1 - stay[1])
    found = [
        _tell(thing, where, apart * weight / total)
        for where, weight in zip((first, later), stay, strict=True)
        if total > 0
    ]
    return tuple(sorted(found, key=lambda was: -was.probability))


def _tell(thing: str, where: _Known, probability: float) -> WasAt:
    return WasAt(thing, where.furniture, where.relation, probability, where.time, where.by)


def _list_known(memory: SceneGraphMemory, thing: str) -> Iterator[_Known]:
    """List when a thing is known to have been where: last sightings, statements, arrivals."""
    events = memory.history(thing)
    for event in events:
        if event.kind != "missed":
            yield _Known(event.time, event.furniture, event.relation, event.by, event.confidence)
    relations = {event.furniture: event.relation for event in reversed(events)}
    changes = [change for change in memory.changes(0) if change.thing == thing]
    for change in changes:
        if change.kind in ("new", "moved") and change.to_place is not None:
            relation = relations.get(change.to_place)
            sure = change.probability
            yield _Known(change.time, change.to_place, relation, change.by, sure)

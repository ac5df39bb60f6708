"""Where things were at a time that has passed, by what the memory keeps of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.belief import compute_stay
from sgm.memory.noticed_changes import ThingEvent
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


def find_past_places(
    memory: SceneGraphMemory, thing: str, begin: int, end: int
) -> tuple[WasAt, ...]:
    """Say where a thing was from a time step to another, the likeliest place first.

    A sighting or statement in that time says so. Else the last one before and the first one after
    it do, each as sure as things stay where they are for that long (`compute_stay`); where both
    name one place, at least one of them has to be right. A look at the place of the sighting before
    that missed it says that it was gone. Nothing is said about the time before a thing was first
    seen.
    """
    known = memory.list_known(thing, begin, end)
    within = [where for where in known if begin <= where.time <= end]
    if within:
        last = within[-1]
        return (_tell(thing, last, last.confidence),)
    before = [where for where in known if where.time < begin][-1:]
    after = [where for where in known if where.time > end][:1]
    if not before:
        return ()
    if _was_missed(memory, thing, before[0], end):
        gap = np.array([later.time - end for later in after])
        return tuple(
            _tell(thing, later, stay * later.confidence)
            for later, stay in zip(after, compute_stay(memory.batch, gap).tolist(), strict=True)
        )
    gaps = [begin - where.time for where in before] + [where.time - end for where in after]
    stay = compute_stay(memory.batch, np.array(gaps)).tolist()
    first = before[0]
    if not after:
        return (_tell(thing, first, stay[0] * first.confidence),)
    later = after[0]
    if (first.furniture, first.relation) == (later.furniture, later.relation):
        both = 1 - (1 - stay[0] * first.confidence) * (1 - stay[1] * later.confidence)
        return (_tell(thing, first if gaps[0] <= gaps[1] else later, both),)
    total = stay[0] + stay[1]
    apart = 1 - (1 - stay[0]) * (1 - stay[1])
    found = [
        _tell(thing, where, apart * weight / total)
        for where, weight in zip((first, later), stay, strict=True)
        if total > 0
    ]
    return tuple(sorted(found, key=lambda was: -was.probability))


def _was_missed(memory: SceneGraphMemory, thing: str, seen: ThingEvent, end: int) -> bool:
    """Tell whether a look missed a thing where it was seen, from then to a time step."""
    return any(
        event.kind == "missed"
        and event.furniture == seen.furniture
        and seen.time < event.time <= end
        for event in memory.history(thing)
    )


def _tell(thing: str, where: ThingEvent, probability: float) -> WasAt:
    return WasAt(thing, where.furniture, where.relation, probability, where.time, where.by)

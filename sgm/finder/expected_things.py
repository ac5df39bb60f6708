"""What to expect at a place at a time: things that were seen there, and on how many such days."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.evidence.similar_moments import PastMoments
from sgm.memory.memory_questions import Asked
from sgm.memory.moments import SHOWN
from sgm.memory.scene_graph_memory import SceneGraphMemory

_AROUND = 1.0  # hours before or after the time of day that is asked about
_WORKDAYS = 5 * 24  # hours of a week, from Monday on


@dataclass(frozen=True, slots=True)
class ExpectedThing:
    """A thing that may be at a place.

    Attributes:
        thing: its id, or its description where it has none.
        probability: that it is there.
        days_seen, days_looked: on how many of how many days of that kind, working days or weekends,
            looks there at that hour, or within one, showed it; of those that the memory keeps
            (`sgm.memory.moments`). 0 without a clock.
        is_workday: of which kind; None without a clock.
    """

    thing: str
    probability: float
    days_seen: int
    days_looked: int
    is_workday: bool | None

    def __str__(self) -> str:
        """Say it in one line, in English."""
        told = f"{self.thing}: {self.probability:.0%}"
        if not self.days_looked:
            return told
        days = "workdays" if self.is_workday else "days of the weekend"
        return f"{told}, at this hour on {self.days_seen} of {self.days_looked} {days}"


def list_expected(
    memory: SceneGraphMemory,
    furniture: int,
    at: datetime | int | None,
    compute_probability: Callable[[str], float],
) -> list[ExpectedThing]:
    """List what was ever seen or said to be at a place, the likeliest first.

    Args:
        memory: what was seen so far.
        furniture: id of the place.
        at: the time, None for now.
        compute_probability: of a thing, by its id or description, that it is there then.

    Raises:
        KeyError: if there is no such furniture.
        ValueError: if the time has passed or is too far ahead.
    """
    memory.layout.check_furniture(furniture)
    named = memory.list_named(*dict.fromkeys(memory.descriptions))
    things = [
        name
        for name in (thing.id or thing.description for thing in named)
        if any(seen.furniture == furniture for seen in memory.places_of(name))
    ]
    if not things:
        return []
    days, is_workday = _count_days(memory.ask(things, at=at), furniture)
    expected = [
        ExpectedThing(thing, compute_probability(thing), *counts, is_workday)
        for thing, counts in zip(things, days, strict=True)
    ]
    return sorted(expected, key=lambda each: -each.probability)


def _count_days(asked: Asked, furniture: int) -> tuple[list[tuple[int, int]], bool | None]:
    """Count days that showed each of the things asked for at a place, of those with looks there.

    And say whether they are working days, None without a clock.
    """
    if asked.batch.clock is None:
        return [(0, 0)] * len(asked.question), None
    past = PastMoments.gather(asked.batch, asked.queries)
    days = []
    for question in asked.question.tolist():
        cells = (past.query == question) & (past.place == asked.furniture_ids.index(furniture))
        ago, states = past.ago[cells].ravel(), past.states[cells].ravel()
        hours, now = past.now[question] - ago, past.now[question]
        is_alike = (states > 0) & (np.abs(np.mod(ago + 12, 24) - 12) <= _AROUND)
        is_alike &= (np.mod(hours, 7 * 24) >= _WORKDAYS) == (now >= _WORKDAYS)
        # From noon to noon around that hour, so that midnight parts no two looks.
        day = np.floor((ago + 12) / 24)
        looked, shown = day[is_alike], day[is_alike & (states == SHOWN)]
        days.append((len(np.unique(shown)), len(np.unique(looked))))
    return days, bool(past.now[0] < _WORKDAYS)

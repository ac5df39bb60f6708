"""On how many days like the one that is asked about looks at that hour showed a thing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.evidence.similar_moments import PastMoments
from sgm.memory.memory_questions import Asked
from sgm.memory.moments import SHOWN
from sgm.names.asking import make_asking
from sgm.names.sections import ENGLISH

_AROUND = 1.0  # hours before or after the time of day that is asked about
_WORKDAYS = 5 * 24  # hours of a week, from Monday on
_FEW = 3  # days: fewer say nothing against the last look
_HALF = 0.5  # share of the days from which on they speak for a place


@dataclass(frozen=True, slots=True)
class DaysSeen:
    """Days of one kind with looks at a place at an hour, or within one, and what they showed.

    Attributes:
        num_seen: on how many a look showed the thing.
        num_looked: how many there are, of those that the memory keeps (`sgm.memory.moments`).
        is_workday: whether they are working days; else those of weekends.
        hours_ago: hours from the last look there to the time that is asked about.
    """

    num_seen: int
    num_looked: int
    is_workday: bool
    hours_ago: float

    def contradicts(self, is_there: bool) -> bool:
        """Tell whether they speak against the last look at the place, if it is no news.

        `is_there` is whether that look showed the thing.
        """
        is_usual = self.num_seen >= _HALF * self.num_looked
        is_known = self.num_looked >= _FEW and self.hours_ago >= _AROUND
        return is_known and is_usual != is_there

    def tell(self, language: str = ENGLISH) -> str:
        """Say it: "at this hour on 9 of 10 workdays"."""
        days = "hour of workdays" if self.is_workday else "hour of weekends"
        return make_asking(language).count(days, self.num_looked, seen=self.num_seen)


def count_days(asked: Asked) -> list[dict[int, DaysSeen]]:
    """Count days for each of the K things asked for, by the position of the place; K of them.

    Places where a thing was never seen, or no look was at that hour, are left out. Without a clock
    nothing is counted.
    """
    counts: list[dict[int, DaysSeen]] = [{} for _ in asked.rows]
    if asked.batch.clock is None or not asked.batch.history.moments.is_counted:
        return counts
    past = PastMoments.gather(asked.batch, asked.queries)
    cell, column = np.nonzero(past.states)
    ago, now = past.ago[cell, column], past.now[past.query[cell]]
    last = np.full(len(past.query), np.inf)
    np.minimum.at(last, cell, ago)
    is_alike = np.abs(np.mod(ago + 12, 24) - 12) <= _AROUND
    is_alike &= (np.mod(now - ago, 7 * 24) >= _WORKDAYS) == (now >= _WORKDAYS)
    cell, ago = cell[is_alike], ago[is_alike]
    is_shown = past.states[cell, column[is_alike]] == SHOWN
    # From noon to noon around that hour, so that midnight parts no two looks.
    day = ((ago + 12) // 24).astype(np.int64)
    num_days = int(day.max(initial=0)) + 1
    days = cell * num_days + day
    looked, shown = (
        np.bincount(np.unique(each) // num_days, minlength=len(last))
        for each in (days, days[is_shown])
    )
    for number in np.flatnonzero(looked).tolist():
        query, place = int(past.query[number]), int(past.place[number])
        counts[query][place] = DaysSeen(
            num_seen=int(shown[number]),
            num_looked=int(looked[number]),
            is_workday=bool(past.now[query] < _WORKDAYS),
            hours_ago=float(last[number]),
        )
    return counts

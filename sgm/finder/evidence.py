"""What a memory holds for and against a place where a thing may be, and how it says that."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sgm.finder.days_seen import DaysSeen
from sgm.memory.sighting import Point, SeenAt
from sgm.memory.thing import ROBOT, Statement
from sgm.names.asking import Asking, make_asking
from sgm.names.sections import ENGLISH

_NAMED = 2  # similar objects that are called by name


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a memory holds about an object at one furniture node.

    Counts of the memory, not an account of what moved the network.

    Attributes:
        seen: its last sighting there; None if it was never seen there.
        times_absent: looks at this furniture that did not find it; of what was seen there, those
            since it was first seen or looked for there.
        similar: descriptions of other objects with a similar label that were seen there, the
            latest first.
        prior: share of this place in where such objects tend to be, 0 to 1.
        seen_on: date and time of that sighting; None without a clock.
        missed_on: date and time of the last look here, if it did not show it any more; None
            without a clock.
        now: date and time of the present step; None without a clock.
        times_sought: looks for it alone since that sighting that did not find it here.
        ended: what was said or done after that sighting, by which it is not here any more; None
            without such a statement.
        ended_ago: time steps since; 0 without a statement.
        ended_on: date and time of it; None without one, or without a clock.
        was_missed: whether a look here, after that sighting and statement, did not show it.
        is_elsewhere: whether another place has shown it after that sighting, and no look here.
        is_in_view: whether a camera shows it here now (`sgm.ros.LiveMemory`).
        days: on how many such days looks here at that hour showed it. None without any, of several
            things, and for the present where they do not speak against the last look here
            (`DaysSeen.contradicts`).
        language: of its sentences.
    """

    seen: SeenAt | None
    times_absent: int
    similar: tuple[str, ...]
    prior: float
    seen_on: datetime | None = None
    missed_on: datetime | None = None
    now: datetime | None = None
    times_sought: int = 0
    ended: Statement | None = None
    ended_ago: int = 0
    ended_on: datetime | None = None
    was_missed: bool = False
    is_elsewhere: bool = False
    is_in_view: bool = False
    days: DaysSeen | None = None
    language: str = ENGLISH

    def __str__(self) -> str:
        """Say it in one line."""
        asking = make_asking(self.language)
        parts = [] if self.days is None else [self.days.tell(self.language)]
        if self.seen is not None:
            parts.append(self._tell_seen(self.seen, asking))
        elif self.times_absent:
            parts.append(asking.count("absent", self.times_absent))
        if self.similar:
            names = ", ".join(map(asking.translate, self.similar[:_NAMED]))
            more = len(self.similar) - _NAMED
            sentence = "similar and more" if more > 0 else "similar"
            parts.append(asking.say(sentence, names=names, number=more))
        if self.prior > 0:
            parts.append(asking.say("prior", percent=f"{self.prior:.0%}"))
        return "; ".join(parts) or asking.say("no evidence")

    def _tell_seen(self, seen: SeenAt, asking: Asking) -> str:
        """Say when it was last seen here, or said to be, what ended that, and who missed it."""
        point = "" if seen.position is None else tell_point(seen.position)
        if self.is_in_view:
            return asking.say("in view at" if point else "in view", point=point)
        is_new = not seen.by and seen.steps_ago == 0
        when = self._tell_ago(asking, seen.steps_ago, None if is_new else self.seen_on)
        sentence = "seen here at" if point else "seen here"
        if seen.by:
            sentence = "put here" if seen.by == ROBOT else "said here"
        told = asking.say(sentence, who=seen.by, when=when, point=point)
        if seen.is_there:
            sought = self.times_sought
            return f"{told}; {asking.count('sought', sought)}" if sought else told
        if self.is_elsewhere:
            return f"{told}; {asking.say('elsewhere since')}"
        if self.ended is not None:
            told += f"; {self._tell_end(self.ended, asking)}"
            if not self.was_missed:
                return told
        elif is_new:
            return asking.say("not in latest" if self.was_missed else "then gone", told=told)
        if self.missed_on is not None and self.now is not None:
            missed = asking.tell_time(self.missed_on, self.now)
            return f"{told}; {asking.say('missed here', when=missed)}"
        if self.ended is None:
            return asking.say("then gone", told=told)
        return f"{told}; {asking.say('missed since')}"

    def _tell_end(self, ended: Statement, asking: Asking) -> str:
        """Say by which statement a thing was at a place no longer."""
        when = self._tell_ago(asking, self.ended_ago, self.ended_on)
        if ended.by == ROBOT and ended.kind != "moved":
            return asking.say("robot took" if ended.kind == "picked_up" else "robot put", when=when)
        return asking.say("said moved", who=asking.tell_who(ended.by), when=when)

    def _tell_ago(self, asking: Asking, steps_ago: int, time: datetime | None) -> str:
        if time is not None and self.now is not None:
            return asking.tell_time(time, self.now)
        return asking.count("ago", steps_ago) if steps_ago else asking.say("this step")


def tell_point(point: Point) -> str:
    """Say a point in the map, to the centimetre: "1.9, 3.1, 0.95"."""
    return ", ".join(f"{round(value, 2) + 0.0:g}" for value in point)

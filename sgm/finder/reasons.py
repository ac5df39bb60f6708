"""Why an object may be at a place: what the memory holds for and against it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.memory.asking import Asked
from sgm.memory.columns import NEVER
from sgm.memory.sighting import SeenAt
from sgm.memory.statement import ROBOT

SIMILAR = 0.7  # cosine of the labels' text vectors: mug and cup .96, document and book .74
_MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip
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
    """

    seen: SeenAt | None
    times_absent: int
    similar: tuple[str, ...]
    prior: float
    seen_on: datetime | None = None
    missed_on: datetime | None = None
    now: datetime | None = None
    times_sought: int = 0

    def __str__(self) -> str:
        """Say it in one line."""
        parts = []
        if self.seen is not None:
            parts.append(self._tell_seen(self.seen))
        elif self.times_absent:
            parts.append(f"not seen here in {_count(self.times_absent, 'look')}")
        if self.similar:
            names = ", ".join(self.similar[:_NAMED])
            more = len(self.similar) - _NAMED
            parts.append(f"similar objects: {names}" + (f" and {more} more" if more > 0 else ""))
        if self.prior > 0:
            parts.append(f"prior {self.prior:.0%}")
        return "; ".join(parts) or "no evidence"

    def _tell_seen(self, seen: SeenAt) -> str:
        """Say when it was last seen here, and whether a later look missed it."""
        if seen.is_there and self.times_sought:
            told = self._tell_when(seen)
            return f"{told}; not found here in {_count(self.times_sought, 'look')} for it since"
        return self._tell_when(seen)

    def _tell_when(self, seen: SeenAt) -> str:
        if seen.by:
            return self._tell_said(seen)
        if seen.steps_ago == 0:
            return "seen here in this step" + ("" if seen.is_there else ", not in the latest look")
        if self.seen_on is None or self.now is None:
            ago = f"seen here {_count(seen.steps_ago, 'step')} ago"
            return ago + ("" if seen.is_there else ", then gone")
        return f"seen here {tell_time(self.seen_on, self.now)}{self._tell_missed(seen)}"

    def _tell_said(self, seen: SeenAt) -> str:
        """Say who said when that it is here, and whether a later look missed it."""
        who = "put here by the robot" if seen.by == ROBOT else f"{seen.by} said so"
        if self.seen_on is None or self.now is None:
            ago = f"{_count(seen.steps_ago, 'step')} ago" if seen.steps_ago else "in this step"
            return f"{who} {ago}" + ("" if seen.is_there else ", then gone")
        return f"{who} {tell_time(self.seen_on, self.now)}{self._tell_missed(seen)}"

    def _tell_missed(self, seen: SeenAt) -> str:
        if seen.is_there or self.missed_on is None or self.now is None:
            return ""
        return f"; not there {tell_time(self.missed_on, self.now)}"


def tell_time(time: datetime, now: datetime) -> str:
    """Say a time as people do: "at 9:10", "yesterday at 21:40", "on 3 November at 8:00"."""
    hour = f"at {time.hour}:{time.minute:02}"
    days = (now.date() - time.date()).days
    if days == 0:
        return hour
    if days == 1:
        return f"yesterday {hour}"
    if days == -1:
        return f"tomorrow {hour}"
    year = f" {time.year}" if time.year != now.year else ""
    return f"on {time.day} {_MONTHS[time.month - 1]}{year} {hour}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def gather_evidence(
    asked: Asked, cosines: np.ndarray | None, furniture: np.ndarray
) -> list[Evidence]:
    """Gather what a memory holds about what was asked for, at some furniture nodes.

    Args:
        asked: what `memory.ask` gave.
        cosines: of the text vectors of every pair of labels of `asked.batch`, (L, L); None to
            leave similar objects out.
        furniture: positions in `asked.furniture_ids`, (n,).

    Returns:
        One entry per furniture node, n of them.
    """
    edges, ids = asked.current.edges, asked.furniture_ids
    seen_at: dict[int | None, SeenAt] = {}
    for sighting in asked.sightings:  # the latest first
        seen_at.setdefault(sighting.furniture, sighting)
    is_own = asked.mark_edges()
    own = np.flatnonzero(is_own)
    num_observed, num_true = np.zeros((2, len(ids)), dtype=np.int64)
    np.maximum.at(num_observed, edges["furniture"][own], edges["num_observed"][own])
    np.add.at(num_true, edges["furniture"][own], edges["num_true"][own])
    # What was never seen at a place was missed by every look at it, and by every search for it.
    num_missed = np.zeros(len(ids), dtype=np.int64)
    num_sought = np.zeros(len(ids), dtype=np.int64)
    for looks in asked.looks:
        sought = np.ceil(looks.negative + looks.sought).astype(np.int64)
        num_sought = np.maximum(num_sought, sought)
        missed = asked.batch.furniture_num_observed[0] + np.ceil(looks.negative).astype(np.int64)
        missed += np.ceil(looks.sought).astype(np.int64)
        num_missed = np.maximum(num_missed, missed)
    num_absent = np.where(num_true > 0, np.maximum(num_observed - num_true, 0), num_missed)
    last_look = asked.current.furniture_last_observed[0]
    similar = _list_similar(asked, cosines, is_own)
    prior = asked.queries.prior.mean(axis=0).sum(axis=1)  # (F,)
    found = []
    said_at = _list_said_away(asked)
    for place in furniture.tolist():
        seen = seen_at.get(ids[place])
        seen_on = missed_on = now = None
        if seen is not None and asked.clock is not None:
            seen_on = asked.clock.get_date(seen.time)
            now = asked.clock.get_date(seen.time + seen.steps_ago)
            if not seen.is_there:
                missed = max(int(last_look[place]), said_at.get(ids[place], NEVER))
                missed_on = asked.clock.get_date(missed)
        found.append(
            Evidence(
                seen=seen,
                times_absent=int(num_absent[place]),
                similar=tuple(similar.get(place, ())),
                prior=float(prior[place]),
                seen_on=seen_on,
                missed_on=missed_on,
                now=now,
                times_sought=0 if seen is None else int(num_sought[place]),
            )
        )
    return found


def _list_said_away(asked: Asked) -> dict[int, int]:
    """Return when it was said last that a thing is no longer at a place, by furniture id."""
    said_at: dict[int, int] = {}
    for said in asked.said:
        if said is not None:
            said_at |= dict.fromkeys(said.was_at, said.time)
    return said_at


def _list_similar(
    asked: Asked, cosines: np.ndarray | None, is_own: np.ndarray
) -> dict[int, dict[str, None]]:
    """List other objects with a similar label by furniture, each once, the latest first."""
    similar: dict[int, dict[str, None]] = {}
    if cosines is None:
        return similar
    edges = asked.current.edges
    label = asked.current.objects["label"]
    own_label = asked.batch.objects["label"][asked.queries.object[0]]
    # Labels that came up in this very step have no vector yet.
    is_known = label < len(cosines)
    is_similar = is_known & (cosines[np.where(is_known, label, 0), own_label] >= SIMILAR)
    alike = np.flatnonzero(is_similar[edges["object"]] & ~is_own & (edges["num_true"] > 0))
    alike = alike[np.argsort(-edges["last_true"][alike], kind="stable")]
    for place, other in zip(
        edges["furniture"][alike].tolist(), edges["object"][alike].tolist(), strict=True
    ):
        similar.setdefault(place, {})[asked.descriptions[other]] = None
    return similar

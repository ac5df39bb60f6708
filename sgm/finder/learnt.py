"""What a memory has learnt of how a home goes: when its things are where, and how sure that is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from sgm.evidence.similar_moments import KINDS, PastMoments, compare_moments
from sgm.finder.tested_looks import TestedLooks
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.moments import SHOWN
from sgm.memory.queries import Queries
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.asking import make_asking
from sgm.names.sections import ENGLISH

MOST_TESTED = 200  # looks
_TOGETHER = 64  # things in one pass
_LEAST_SIGHTINGS = 4  # of a thing of which something is said
_LEAST_GAIN = 0.02  # nats per moment: what keeps to its hours more than this has a rhythm
_LEAST_SCORE = 3.0  # nats in all: twenty times likelier than without
_LEAST_LOOKS = 2  # of an hour of the day
_SURE = 0.6  # share of the looks, or of what comes next
_USUAL = 0.8  # share of the sightings that the places looked at in an hour must have
_ALIKE = 1.5  # factor between lags that are alike
_DAYS = {"day": (("workdays", 0), ("weekends", 1)), "hour": (("all days", 0),)}


@dataclass(frozen=True, slots=True)
class Stay:
    """Where a thing is at some hours.

    Attributes:
        place: furniture id; None for none of the places where it was ever seen.
        name: of the place; empty for none.
        days: "workdays", "weekends" or "all days".
        begin, end: first and last hour of the day, 0 to 24, that looks have shown; past midnight
            the end is the smaller one.
    """

    place: int | None
    name: str
    days: str
    begin: int
    end: int

    def tell(self, language: str = ENGLISH) -> str:
        """Say it: "out on workdays from 8 to 18"."""
        asking = make_asking(language)
        return asking.say(
            "stay at" if self.begin == self.end else "stay from",
            place=asking.say("out") if self.place is None else asking.translate(self.name),
            days=asking.say(self.days),
            begin=self.begin,
            end=self.end,
        )


@dataclass(frozen=True, slots=True)
class Passage:
    """Where a thing goes next.

    Attributes:
        begin, end: furniture ids.
        names: of both.
        hours: from the first sighting at the one to the first at the other, the median.
        number, num_left: how many of how many stays ended so.
    """

    begin: int
    end: int
    names: tuple[str, str]
    hours: float
    number: int
    num_left: int

    def tell(self, language: str = ENGLISH) -> str:
        """Say it: "from table to sink after 1 h (18 of 20)"."""
        asking = make_asking(language)
        before, where = map(asking.translate, self.names)
        return asking.say(
            "passage",
            before=before,
            where=where,
            hours=f"{self.hours:.2g}",
            number=self.number,
            total=self.num_left,
        )


@dataclass(frozen=True, slots=True)
class LearntThing:
    """What was learnt of one thing.

    Attributes:
        thing: its description.
        rhythm: what tells best where it is: "hour" of the day, hour and kind of "day", "lag" since
            it was seen, both as "hour_lag"; "any" if it keeps to none of these.
        usual: furniture id of the place that showed it most often.
        usual_name: of that place.
        share: of the looks there, how many showed it, 0 to 1.
        stays: where it is at the hours when it is not there; none without a rhythm of hours.
        passages: where it goes next; none without a rhythm of lags.
        language: of its sentences.
    """

    thing: str
    rhythm: str
    usual: int
    usual_name: str
    share: float
    stays: tuple[Stay, ...] = ()
    passages: tuple[Passage, ...] = ()
    language: str = ENGLISH

    @property
    def said(self) -> str:
        """What was learnt, without the thing."""
        asking = make_asking(self.language)
        told = [stay.tell(self.language) for stay in self.stays]
        told += [passage.tell(self.language) for passage in self.passages]
        name, percent = asking.translate(self.usual_name), f"{self.share:.0%}"
        return "; ".join([*told, asking.say("usual place", place=name, percent=percent)])

    def __str__(self) -> str:
        """Say it in one line."""
        return f"{make_asking(self.language).translate(self.thing)}: {self.said}"


@dataclass(frozen=True, slots=True)
class Learnt:
    """What a memory has learnt of a home.

    Attributes:
        things: that were seen often enough, those with the clearest rhythm first.
        sure: probability that similar moments gave the places that were looked at, the mean over
            the latest looks at the place that they held for the likeliest; nan without such looks.
        right: share of these looks that showed the thing.
        num_looks: how many they were, `MOST_TESTED` at most.
        language: of its sentences.
    """

    things: tuple[LearntThing, ...]
    sure: float
    right: float
    num_looks: int
    language: str = ENGLISH

    @property
    def score(self) -> str:
        """How sure it was and how often right, in one line; empty without looks."""
        sure, right = f"{self.sure:.2f}", f"{self.right:.2f}"
        asking, number = make_asking(self.language), self.num_looks
        return asking.count("learnt score", number, sure=sure, right=right) if number else ""

    def __str__(self) -> str:
        """Say it, a line for each thing."""
        lines = [*map(str, self.things), self.score]
        told = "\n".join(filter(None, lines))
        return told or make_asking(self.language).say("nothing learnt")


def tell_learnt(memory: SceneGraphMemory, k: int | None = None) -> Learnt:
    """Say what a memory with a clock has learnt of k things at most; nothing of one without.

    Raises:
        ValueError: if there is no furniture yet.
    """
    names = memory.descriptions
    language = memory.language
    if not names or memory.clock is None:
        return Learnt((), float("nan"), float("nan"), 0, language)
    asked = memory.ask(names[:1], before_looks=False)
    batch, objects = asked.batch, asked.batch.objects
    told: list[tuple[float, LearntThing]] = []
    tested = TestedLooks(MOST_TESTED)
    rows = np.flatnonzero((objects["num_observed"] > 0) & (objects["same_as"] < 0))
    rows = rows[rows < len(names)]
    for things in np.split(rows, range(_TOGETHER, len(rows), _TOGETHER)):
        past = _gather(batch, things)
        tested.add(past)
        similar = compare_moments(past)
        for query, thing in enumerate(things.tolist()):
            table = _Sightings.of(past, query)
            if table.is_shown.sum() < _LEAST_SIGHTINGS:
                continue
            kind = int(similar.gain[query].argmax())
            gain = float(similar.gain[query, kind])
            if gain < _LEAST_GAIN or gain * similar.amount[query, -1] < _LEAST_SCORE:
                kind, gain = KINDS.index("any"), 0.0
            ids, places = asked.furniture_ids, asked.furniture_names
            learnt = table.tell(names[thing], KINDS[kind], ids, places)
            told.append((gain, replace(learnt, language=language)))
    told.sort(key=lambda each: -each[0])
    sure, right = tested.score()
    first = tuple(thing for _, thing in told[:k])
    return Learnt(first, sure, right, tested.num_looks, language)


def _gather(batch: MemoryBatch, things: np.ndarray) -> PastMoments:
    home = np.zeros(len(things), dtype=np.int64)
    prior = batch.place_prior.rows(home, batch.objects["type"][things])
    return PastMoments.gather(batch, Queries(home, things, prior))


@dataclass(frozen=True, slots=True)
class _Sightings:
    """What the moments at the places of one thing said of it, the earliest first, n of them.

    Attributes:
        place: position of the furniture, (n,).
        hours: since Monday 00:00 of the present week, below 0 before it, (n,).
        is_shown: whether it showed the thing, bool (n,).
    """

    place: np.ndarray
    hours: np.ndarray
    is_shown: np.ndarray

    @classmethod
    def of(cls, past: PastMoments, query: int) -> _Sightings:
        """Take those of one question."""
        cells = np.flatnonzero(past.query == query)
        cell, column = np.nonzero(past.states[cells])
        cell = cells[cell]
        ago = past.ago[cell, column]
        order = np.argsort(-ago, kind="stable")
        is_shown = past.states[cell, column] == SHOWN
        hours = past.now[query] - ago
        return cls(past.place[cell][order], hours[order], is_shown[order])

    def tell(
        self, thing: str, rhythm: str, ids: tuple[int, ...], names: tuple[str, ...]
    ) -> LearntThing:
        """Say where the thing is."""
        usual, share = self._find_usual()
        stays = [
            Stay(None if at < 0 else ids[at], "" if at < 0 else names[at], days, begin, end)
            for at, days, begin, end in self._list_stays(rhythm)
            if at != usual
        ]
        passages = [
            Passage(ids[at], ids[then], (names[at], names[then]), hours, number, num_left)
            for at, then, hours, number, num_left in self._list_passages()
            if "lag" in rhythm
        ]
        return LearntThing(
            thing, rhythm, ids[usual], names[usual], share, tuple(stays), tuple(passages)
        )

    def _find_usual(self) -> tuple[int, float]:
        """Return the place that showed it the most often, and what share of the looks did."""
        shown = np.bincount(self.place, self.is_shown)
        place = int(shown.argmax())
        return place, float(shown[place] / (self.place == place).sum())

    def _list_stays(self, rhythm: str) -> Iterator[tuple[int, str, int, int]]:
        """List where it is at which days and hours, -1 for out."""
        hour = np.mod(self.hours, 24).astype(np.int64)
        is_weekend = np.mod(self.hours, 7 * 24) >= 5 * 24
        for days, number in _DAYS.get(rhythm, ()):
            is_day = is_weekend == number if rhythm == "day" else np.ones(len(hour), dtype=bool)
            found: dict[int, int] = {}  # place by hour, where it is known
            for each in range(24):
                place = self._find_place(is_day & (hour == each))
                if place is not None:
                    found[each] = place
            for place, begin, end in _join_hours(found):
                yield place, days, begin, end

    def _find_place(self, is_meant: np.ndarray) -> int | None:
        """Return where it is at some moments, -1 for out, None if they do not tell."""
        total = np.bincount(self.place[is_meant], minlength=self.place.max() + 1)
        if total.max() < _LEAST_LOOKS:
            return None
        shown = np.bincount(self.place[is_meant], self.is_shown[is_meant], len(total))
        share = shown / np.maximum(total, 1)
        if share.max() >= _SURE:
            return int(share.argmax())
        sightings = np.bincount(self.place, self.is_shown, len(total))
        is_told = sightings[total >= _LEAST_LOOKS].sum() >= _USUAL * sightings.sum()
        return -1 if is_told and share.sum() <= 1 - _SURE else None

    def _list_passages(self) -> Iterator[tuple[int, int, float, int, int]]:
        """List places after which it is mostly at the same one, and when."""
        place, hours = self.place[self.is_shown], self.hours[self.is_shown]
        is_first = np.ones(len(place), dtype=bool)
        is_first[1:] = place[1:] != place[:-1]
        place, hours = place[is_first], hours[is_first]
        left = place[:-1].tolist()
        pairs = list(zip(left, place[1:].tolist(), strict=True))
        lags = np.diff(hours).tolist()
        num_left = Counter(left)
        for (first, then), number in sorted(Counter(pairs).items()):
            if number < _LEAST_SIGHTINGS or number < _SURE * num_left[first]:
                continue
            took = [lag for lag, pair in zip(lags, pairs, strict=True) if pair == (first, then)]
            lag = median(took)
            is_alike = [lag / _ALIKE <= each <= lag * _ALIKE for each in took]
            if sum(is_alike) >= _USUAL * number:
                yield first, then, float(lag), number, num_left[first]


def _join_hours(found: dict[int, int]) -> Iterator[tuple[int, int, int]]:
    """List place, first and last hour of each run of hours at one place, around midnight, too.

    It lasts until the hour in which the next one begins, where that is known.
    """
    hours = sorted(found)
    if len(set(found.values())) < 2:
        if hours:
            yield found[hours[0]], hours[0], hours[-1]
        return
    begin = next(n for n in range(len(hours)) if found[hours[n]] != found[hours[n - 1]])
    hours = hours[begin:] + hours[:begin]
    first = hours[0]
    for this, after in zip(hours, [*hours[1:], hours[0]], strict=True):
        if found[after] != found[this]:
            yield found[this], first, (after or 24) if after == (this + 1) % 24 else this
            first = after

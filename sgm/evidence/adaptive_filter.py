"""Filters that know no rules of the home: rates and destinations come from its own counts.

They say where things can be, given the last sighting of each and the looks since.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sgm.evidence.look_filter import Destinations, follow, move_once
from sgm.evidence.question import Question, count_missed_then
from sgm.evidence.rows import log_share, rank_rows
from sgm.memory.home_history import HomeHistory
from sgm.memory.memory_batch import MemoryBatch

TASKS_ASK_MOVED = 0.5  # share of questions about what has just moved; docs/design.md, ruling 9
_SAME = 0.97  # probability that what is seen is the object that is asked for
_TINY = 1e-12


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """One adaptive filter.

    Attributes:
        rate: at which objects leave, per hour; None for the object's own, from its counts.
        crossing: share of the moves that do not stay in the room; None for the home's own.
        asks_moved: how likely an object that is asked for has moved in this step, if any has;
            None if it surely has.
        hours: how much the hour of day at which it was seen matters for where it goes, 0 to 1.
        counts_left: whether an object's own rate is that at which it was found gone, wherever it
            went, or that at which it was found elsewhere.
    """

    rate: float | None = None
    crossing: float | None = None
    asks_moved: float | None = 0.0
    hours: float = 0.0
    counts_left: bool = False


# Filters that the features show, by name; the network weighs them.
FILTERS = {
    "anywhere": FilterSettings(crossing=1.0),
    "in_room": FilterSettings(crossing=0.0),
    "learnt": FilterSettings(),
    "slow": FilterSettings(rate=0.02, crossing=1.0),
    "fast": FilterSettings(rate=0.15, crossing=1.0),
    "moved": FilterSettings(asks_moved=None),
    "moved_in_room": FilterSettings(asks_moved=None, crossing=0.0),
    "asked": FilterSettings(asks_moved=TASKS_ASK_MOVED),
    "left": FilterSettings(counts_left=True),
    "left_asked": FilterSettings(counts_left=True, asks_moved=TASKS_ASK_MOVED),
}
RANKING = "asked"  # the filter whose belief ranks the places


@lru_cache(maxsize=16)
def list_filters(asks_moved: float) -> tuple[FilterSettings, ...]:
    """Return `FILTERS`, those of the questions of tasks for such questions instead."""
    return tuple(
        replace(settings, asks_moved=asks_moved)
        if settings.asks_moved == TASKS_ASK_MOVED
        else settings
        for settings in FILTERS.values()
    )


class Rates(NamedTuple):
    """What the counts say about how objects move, per hour.

    Attributes:
        home: of the average object of the home, (Q,).
        thing: of the object asked for, (Q,).
        crossing: share of the moves that lead to another room, (Q,).
        any_moved: how likely any object has moved in the last step, (Q,).
        miss: how likely a look misses what is there, (Q,).
        home_left: at which the average object of the home is found gone from its place, (Q,).
        left: at which the object asked for is, (Q,).
    """

    home: np.ndarray
    thing: np.ndarray
    crossing: np.ndarray
    any_moved: np.ndarray
    miss: np.ndarray
    home_left: np.ndarray
    left: np.ndarray

    @classmethod
    def estimate(cls, asked: Question) -> Rates:
        """Estimate the rates; each is the mean of a posterior that starts with a weak prior."""
        sums, counts, hours = asked.sums, asked.counts, asked.hours
        crossing = (sums.num_crossing + 0.5) / (sums.arrivals.sum(axis=1) + 1)
        home_left = (sums.num_left[asked.home] + 0.5) / (sums.time_true[asked.home] * hours + 15)
        num_left, time = counts.num_left.sum(axis=1), counts.time_true.sum(axis=1)
        left = np.clip((num_left + 1.5) / (time * hours + 1.5 / home_left), 1e-4, 2.0)
        home, thing = compute_move_rates(
            asked.memory, asked.history, asked.home, asked.thing, asked.step_hours
        )
        num_seen = np.maximum(sums.num_seen[asked.home], 1)
        return cls(
            home=home,
            thing=thing,
            crossing=crossing[asked.home],
            any_moved=-np.expm1(-home * hours * num_seen),
            miss=asked.history.compute_miss_rate(asked.queries.miss_rate)[asked.home],
            home_left=home_left,
            left=left,
        )


def compute_move_rates(
    memory: MemoryBatch,
    history: HomeHistory,
    home: np.ndarray,
    thing: np.ndarray,
    step_hours: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the moves per hour of the home's average object and of things, (n,) each.

    That of a thing is the mean of a posterior that starts with the home's. Looks for a thing alone
    where it was last seen have followed it since: it did not come back. That is counted as if the
    home had followed it, for this thing alone. `thing` are their rows, (n,), and `step_hours` those
    of `compute_step_hours`, (H,).
    """
    objects = memory.objects
    average = history.compute_move_rate(step_hours)[home]
    if (lone := memory.find_lone_looks(thing)) is not None:
        last = objects["last_furniture"][thing]
        since = lone.last[np.arange(len(thing)), last] - objects["last_observed"][thing]
        followed = np.where(last >= 0, np.maximum(since, 0), 0) * step_hours[home]
        counters = history.counters
        total = counters["time_followed"][home] * step_hours[home] + followed + 15
        average = np.where(followed > 0, (counters["num_moved"][home] + 0.5) / total, average)
    known = objects["last_observed"][thing] - objects["first_observed"][thing]
    num_moved = objects["num_moved"][thing]
    rate = (num_moved + 1.5) / (known * step_hours[home] + 1.5 / average)
    return average, np.clip(rate, 1e-4, 2.0)


def compute_beliefs(
    asked: Question, rates: Rates, destinations: np.ndarray, filters: Sequence[FilterSettings]
) -> np.ndarray:
    """Follow filters from the last sighting of each object over the looks since.

    Between looks an object leaves its place at a rate, for a place drawn from its destinations:
    within its room, or anywhere with the share `crossing`. For a time t this has a closed form,
    so that a question costs the same after ten steps or a million:

        M_r(t) = P_r + exp(-rate crossing t) (M_r(0) - P_r)
        b_f(t) = M_r(t) q_f + exp(-rate t) (b_f(0) - M_r(0) q_f)

    with M_r the probability of the room, P_r that of its destinations and q_f the share of the
    place in these. A look that does not find the object multiplies the place by the miss rate.
    Only the latest `NUM_LOOKS_KEPT` looks at each furniture node are known. Rates and destinations,
    (Q, F + 1), are those of the same question.

    Returns:
        Probability of each place and of elsewhere by each of K filters, (Q, K, F + 1).
    """
    memory = asked.memory
    num_rooms = memory.room_label.shape[1] + 1
    room = np.full(destinations.shape, num_rooms - 1, dtype=np.int64)  # elsewhere is no room
    room[:, :-1] = np.where(asked.is_place, asked.room, -1)
    shape = (len(asked.home), len(filters))
    rate, crossing, moved = np.empty(shape), np.empty(shape), np.empty(shape)
    for number, settings in enumerate(filters):
        learnt = rates.left if settings.counts_left else rates.thing
        rate[:, number] = learnt if settings.rate is None else settings.rate
        crossing[:, number] = rates.crossing if settings.crossing is None else settings.crossing
        asks_moved = settings.asks_moved
        moved[:, number] = 1 if asks_moved is None else asks_moved * rates.any_moved
    return follow_looks(
        destination=destinations,
        room=room,
        num_rooms=num_rooms,
        look_times=asked.look_times,
        look_row=asked.look_row,
        last_place=asked.last.astype(np.int64),
        last_time=memory.objects["last_observed"][asked.thing].astype(np.int64),
        now=memory.time,
        hours=asked.hours,
        rate=rate,
        crossing=crossing,
        moved=moved,
        miss=rates.miss,
        missed_then=count_missed_then(asked),
    )


def compute_filters(asked: Question, beliefs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What the adaptive filters believe, by name, the last place elsewhere, (Q, F + 1)."""
    columns = {}
    for name, belief in beliefs.items():
        columns[f"belief_{name}"] = belief[:, :-1]
        columns[f"log_belief_{name}"] = log_share(belief[:, :-1], asked.num_places)
    columns["belief_rank"] = rank_rows(beliefs[RANKING][:, :-1], asked.is_place)
    return columns


def follow_looks(
    *,
    destination: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    look_times: np.ndarray,
    look_row: np.ndarray,
    last_place: np.ndarray,
    last_time: np.ndarray,
    now: int,
    hours: np.ndarray,
    rate: np.ndarray,
    crossing: np.ndarray,
    moved: np.ndarray,
    miss: np.ndarray,
    missed_then: np.ndarray | None = None,
) -> np.ndarray:
    """Follow K filters over the looks at Q objects; see `compute_beliefs`.

    Args:
        destination: where each object goes, sums to one, float64 (Q, P); the last place is
            elsewhere.
        room: of each place, -1 where there is none, int64 (Q, P).
        num_rooms: room numbers are below it.
        look_times: of the latest looks at each place but elsewhere, -1 for none, (n, P - 1, L).
        look_row: which row of these are the looks for each object, (Q,).
        last_place: where it was last seen, -1 for never, int64 (Q,).
        last_time: when, int64 (Q,).
        now: the present time step.
        hours: length of a step, (Q,).
        rate: at which it leaves, per hour, (Q, K).
        crossing: share of its ways that lead anywhere, not within the room, (Q, K).
        moved: how likely it has just moved, since it is asked for, (Q, K).
        miss: probability that a look misses it, (Q,).
        missed_then: looks at the place of the last sighting, in its time step and after it, (Q,);
            None for none.

    Returns:
        Probabilities of the places, (Q, K, P).
    """
    looks = LooksSince.list(look_times, look_row, last_place, last_time)
    if missed_then is not None and missed_then.any():
        looks = looks.begin_with(last_place, last_time, missed_then)
    is_now = looks.when == now
    since = looks.take(~is_now)
    steps = since.count_steps(since.start(last_place, last_time, now), now)
    filters, number = _find_twins(rate, crossing)
    detection = since.compute_detection(miss)
    # At the last sighting, or before the first look.
    was_seen = np.flatnonzero(last_place >= 0)
    belief = destination.T[..., None].copy()
    belief[:, was_seen] *= 1 - _SAME
    belief[last_place[was_seen], was_seen] += _SAME
    # Nothing moved since it was seen in this step.
    was_seen_now = (last_place >= 0) & (last_time == now)
    moved = np.where(was_seen_now[:, None], 0.0, moved)
    goes = Destinations.of(destination.T, room.T, num_rooms)
    belief = follow(
        belief, goes, since.where, detection, steps * hours, rate[:, filters], crossing[:, filters]
    )
    belief = move_once(belief[..., number], goes, crossing, moved)
    if is_now.any():
        num_missed = np.zeros(goes.room.shape, dtype=np.int64)
        look, query = np.nonzero(is_now)
        np.add.at(num_missed, (looks.where[look, query], query), looks.number[look, query])
        belief *= (miss**num_missed)[..., None]
    belief /= np.maximum(np.add.accumulate(belief)[-1], _TINY)
    return np.ascontiguousarray(belief.transpose(1, 2, 0))


def _find_twins(rate: np.ndarray, crossing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return filters that differ in rate or crossing, (k,), and for each filter which, (K,).

    The others differ in the move just before the question alone.
    """
    both = np.concatenate([rate, crossing])  # (2 Q, K)
    is_twin = (both[:, :, None] == both[:, None]).all(axis=0)
    first = is_twin.argmax(axis=1)
    is_first = first == np.arange(len(first))
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[first]


class LooksSince(NamedTuple):
    """The looks since Q things were last seen, aligned at their ends.

    Looks at one place in one time step are one look here.

    Attributes:
        when, where: time, that of the sighting or 0 before it, and place, (n, Q).
        number: of looks at that place in that step, (n, Q); 0 for what is no look.
    """

    when: np.ndarray
    where: np.ndarray
    number: np.ndarray

    @classmethod
    def list(
        cls,
        look_times: np.ndarray,
        look_row: np.ndarray,
        last_place: np.ndarray,
        last_time: np.ndarray,
    ) -> LooksSince:
        """List looks but for those that saw the thing; arguments as of `follow_looks`."""
        num_kept = look_times.shape[2]
        times, number = _join_equal(look_times)
        times, number = (each.reshape(len(look_times), -1).T for each in (times, number))
        order = times.argsort(axis=0, kind="stable")
        # From the end on, as many as any home has: what is no look has the time -1.
        order = order[len(times) - np.count_nonzero(times >= 0, axis=0).max(initial=0) :]
        home = np.arange(len(look_times))
        when, number = times[order, home][:, look_row], number[order, home][:, look_row]
        where = (order // num_kept)[:, look_row]
        start = np.where(last_place >= 0, last_time, -1)
        counts = (when >= np.maximum(start, 0)) & ((when > start) | (where != last_place))
        return cls(when=when, where=where, number=number)._choose(counts)

    def begin_with(
        self, last_place: np.ndarray, last_time: np.ndarray, number: np.ndarray
    ) -> LooksSince:
        """Return these looks after so many at the place and in the step of the sighting, (Q,)."""
        first = last_time, np.maximum(last_place, 0), number
        return LooksSince(*(np.concatenate([a[None], b]) for a, b in zip(first, self, strict=True)))

    def take(self, chosen: np.ndarray) -> LooksSince:
        """Leave the other looks out, bool (n, Q)."""
        return self if chosen.all() else self._choose(chosen)

    def _choose(self, chosen: np.ndarray) -> LooksSince:
        number = self.number * chosen
        used = number.any(axis=1)
        return LooksSince(when=self.when[used], where=self.where[used], number=number[used])

    def start(self, last_place: np.ndarray, last_time: np.ndarray, now: int) -> np.ndarray:
        """Return when each belief starts: at the last sighting, else at the first look, (Q,)."""
        first = np.where(self.number > 0, self.when, now).min(axis=0, initial=now)
        return np.where(last_place >= 0, last_time, first)

    def compute_detection(self, miss: np.ndarray) -> np.ndarray:
        """Return how likely each shows what is there, 0 for what is no look, (Q,) -> (n, Q)."""
        detection: np.ndarray = 1 - miss**self.number
        return detection

    def count_steps(self, start: np.ndarray, now: int) -> np.ndarray:
        """Return the time steps from the start until each look, and until now, (n + 1, Q).

        What is no look is at the time of the look before it.
        """
        time = np.full((len(self.when) + 1, len(start)), now)
        time[:-1] = np.where(self.number > 0, self.when, start)
        return np.maximum.accumulate(time, axis=0) - start


def _join_equal(look_times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times of looks of which equal ones at a place are one, and how many each is.

    Both (m, F, L), -1 and 1 for what is no look or another one.
    """
    times = np.sort(look_times, axis=2)
    is_next_equal = np.zeros(times.shape, dtype=bool)
    np.equal(times[..., 1:], times[..., :-1], out=is_next_equal[..., :-1])
    is_next_equal &= times >= 0
    number = np.ones(times.shape, dtype=np.int64)
    if is_next_equal.any():
        for kept in range(1, times.shape[2]):
            number[..., kept] += number[..., kept - 1] * is_next_equal[..., kept - 1]
        times = np.where(is_next_equal, -1, times)
    return times, number

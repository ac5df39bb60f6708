"""A filter that knows no rules of the home: rates and destinations come from its own counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import sum_rows
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts, compute_hour, compute_hours_per_step
from sgm.evidence.sighting_filter import follow_looks
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

TASKS_ASK_MOVED = 0.5  # share of questions about what has just moved; docs/design.md, ruling 9
_HOUR_WIDTH = 4.0  # concentration of the hours that count as alike: about three to each side


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


class Rates(NamedTuple):
    """What the counts say about how objects move, per hour.

    Attributes:
        home: of the average object of the home, (Q,).
        own: of the object asked for, (Q,).
        crossing: share of the moves that lead to another room, (Q,).
        any_moved: how likely any object has moved in the last step, (Q,).
        miss: how likely a look misses what is there, (Q,).
        home_left: at which the average object of the home is found gone from its place, (Q,).
        left: at which the object asked for is, (Q,).
    """

    home: np.ndarray
    own: np.ndarray
    crossing: np.ndarray
    any_moved: np.ndarray
    miss: np.ndarray
    home_left: np.ndarray
    left: np.ndarray

    @classmethod
    def estimate(
        cls, memory: MemoryBatch, queries: Queries, counts: ObjectCounts, sums: HomeSums
    ) -> Rates:
        """Estimate the rates; each is the mean of a posterior that starts with a weak prior.

        The counts are `ObjectCounts.gather` of the same memory and objects, the sums of its homes.
        """
        hours, home, own = compute_own_rates(memory, queries.home, queries.object)
        num_seen = sums.num_seen[queries.home]
        home_left, left = _compute_left_rates(sums, queries, counts, hours)
        return cls(
            home=home,
            own=own,
            crossing=_compute_crossing(memory, sums)[queries.home],
            any_moved=-np.expm1(-home * hours * np.maximum(num_seen, 1)),
            miss=memory.history.compute_miss_rate()[queries.home],
            home_left=home_left,
            left=left,
        )


def compute_destinations(
    memory: MemoryBatch,
    queries: Queries,
    counts: ObjectCounts,
    expected: Expected,
    hours: float = 0.0,
) -> np.ndarray:
    """Return where each object goes when it moves, (Q, F + 1), the last column elsewhere.

    In proportion to how often it was seen at a place, plus what is expected as one more sighting,
    plus a little everywhere: more where nothing is expected. `hours` says how much sightings at
    other hours of the day are discounted, 0 to 1.
    """
    trust = expected.trust[:, None]
    seen = counts.num_true.astype(float)
    if hours > 0 and memory.clock is not None:
        near = np.einsum("qfh,qh->qf", counts.hours[0], weigh_hour(memory, queries.home))
        seen = seen * (1 - hours) + hours * near
    return _spread(memory, queries, seen + trust * expected.share, 0.3 + (1 - trust))


def _spread(
    memory: MemoryBatch, queries: Queries, weight: np.ndarray, anywhere: np.ndarray
) -> np.ndarray:
    """Spread `anywhere`, (Q, 1), over all places beside their own weights, (Q, F).

    Elsewhere, the last column, gets as much as one place; rows sum to one, (Q, F + 1).
    """
    is_place = memory.is_furniture[queries.home]
    num_places = is_place.sum(axis=1)
    anywhere = anywhere / num_places[:, None]
    weight = (weight + anywhere) * is_place
    total = sum_rows(weight, num_places)[:, None] + anywhere
    return np.append(weight, anywhere, axis=1) / total


def weigh_hour(memory: MemoryBatch, home: np.ndarray, width: float = _HOUR_WIDTH) -> np.ndarray:
    """Return how near each bin of the day is to the present hour in homes, (n, NUM_HOURS).

    1 at the present hour, whatever the width; 0 in a home without a clock.
    """
    middle = (np.arange(NUM_HOURS) + 0.5) * (24 / NUM_HOURS)
    apart = middle - compute_hour(memory, home)[:, None]
    return np.nan_to_num(np.exp(width * (np.cos(apart * (2 * np.pi / 24)) - 1)))


def compute_beliefs(
    memory: MemoryBatch,
    queries: Queries,
    rates: Rates,
    destinations: np.ndarray,
    filters: Sequence[FilterSettings],
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
    (Q, F + 1), are those of the same memory and objects.

    Returns:
        Probability of each place and of elsewhere by each of K filters, (Q, K, F + 1).
    """
    num_queries, home = len(queries.home), queries.home
    num_rooms = memory.room_label.shape[1] + 1
    room = np.full(destinations.shape, num_rooms - 1, dtype=np.int64)  # elsewhere is no room
    room[:, :-1] = np.where(memory.is_furniture[home], memory.furniture_room[home], -1)
    shape = (num_queries, len(filters))
    rate, crossing, moved = np.empty(shape), np.empty(shape), np.empty(shape)
    for number, one in enumerate(filters):
        own = rates.left if one.counts_left else rates.own
        rate[:, number] = own if one.rate is None else one.rate
        crossing[:, number] = rates.crossing if one.crossing is None else one.crossing
        moved[:, number] = 1 if one.asks_moved is None else one.asks_moved * rates.any_moved
    look_times, look_row = list_look_times(memory, queries)
    return follow_looks(
        destination=destinations,
        room=room,
        num_rooms=num_rooms,
        look_times=look_times,
        look_row=look_row,
        last_place=memory.objects["last_furniture"][queries.object].astype(np.int64),
        last_time=memory.objects["last_observed"][queries.object].astype(np.int64),
        now=memory.time,
        hours=compute_hours_per_step(memory, home),
        rate=rate,
        crossing=crossing,
        moved=moved,
        miss=rates.miss,
    )


def list_look_times(memory: MemoryBatch, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
    """Return when places were looked at, (m, F, n), and the row for what is asked for, (Q,)."""
    history = memory.history
    if history.look_relations is None:
        return np.ascontiguousarray(history.look_times), queries.home.astype(np.int64)
    times = history.list_look_times(queries.home, memory.compute_relation_shares(queries))
    return times, np.arange(len(times))


def _compute_left_rates(
    sums: HomeSums, queries: Queries, counts: ObjectCounts, hours: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates at which things, and the one asked for, are found gone, (Q,) each."""
    num_left, time = sums.num_left[queries.home], sums.time_true[queries.home]
    of_home = (num_left + 0.5) / (time * hours + 15)
    num_left, time = counts.num_left.sum(axis=1), counts.time_true.sum(axis=1)
    return of_home, np.clip((num_left + 1.5) / (time * hours + 1.5 / of_home), 1e-4, 2.0)


def compute_own_rates(
    memory: MemoryBatch, home: np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return hours per step, and moves per hour of the home's average object and of the own, (n,).

    The own rate is the mean of a posterior that starts with the home's.
    """
    objects = memory.objects
    of_homes = compute_hours_per_step(memory, np.arange(memory.num_homes))
    hours = of_homes[home]
    average = memory.history.compute_move_rate(of_homes)[home]
    known = objects["last_observed"][row] - objects["first_observed"][row]
    own = (objects["num_moved"][row] + 1.5) / (known * hours + 1.5 / average)
    return hours, average, np.clip(own, 1e-4, 2.0)


def _compute_crossing(memory: MemoryBatch, sums: HomeSums) -> np.ndarray:
    """Return which share of the moves seen led to another room, (H,)."""
    if not memory.history.counts_moves:
        return np.full(memory.num_homes, 0.5)
    return (sums.num_crossing + 0.5) / (sums.arrivals.sum(axis=1) + 1)

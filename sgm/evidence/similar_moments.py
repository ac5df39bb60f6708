"""Where a thing was in moments like the one that is asked about.

For each place, of the looks there in such moments the share that showed the thing. Moments are
alike by the hour of day, by the hour and the kind of day, by how long ago the thing had been seen
where it was seen last, or by that and the hour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.arrays.week import HOUR_SECONDS, compute_week_seconds
from sgm.evidence.question import compute_step_hours
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.moments import MISSED, NUM_MOMENTS, SHOWN
from sgm.memory.queries import Queries
from sgm.schema import NEVER

KINDS = ("hour", "day", "lag", "hour_lag", "any")  # by what moments are alike; all of them

_HALF_LIFE = 21 * 24.0  # hours after which a moment counts half
_HOUR_WIDTH = 1.0  # standard deviation of hours that are alike
_OTHER_DAY = 0.05  # what a day of the other kind, working day or weekend, counts
_LAG_WIDTH = 0.3  # standard deviation of lags that are alike, of their logarithm
_LEAST_LAG = 0.25  # hours
_USUAL = 0.3  # moments that the share of all moments counts for
_FORGOTTEN = 1.5  # hours in which a look that missed a thing says a third of what it said
_LEAST = 0.03  # share of each answer that is even
_PULL = 1.0  # moments that the share of all moments counts for where others are kept apart
_NUM_LAGS = 10  # half an hour to ten days


@dataclass(frozen=True, slots=True)
class PastMoments:
    """The moments at C places where things of Q questions were seen, n at each.

    Attributes:
        query: number of the question, ascending, (C,).
        place: the place, (C,).
        ago: how many hours before the time of the question they were, (C, n).
        states: what they said of the thing, uint8 (C, n), 0 for nothing.
        now: hours since Monday 00:00, (Q,).
        lag: hours since the thing was seen last, (Q,).
        last: where that was, -1 for nowhere, (Q,).
        detection: share of the looks that show what is there, (Q,).
        is_place: which columns are furniture of the home, bool (Q, F).
    """

    query: np.ndarray
    place: np.ndarray
    ago: np.ndarray
    states: np.ndarray
    now: np.ndarray
    lag: np.ndarray
    last: np.ndarray
    detection: np.ndarray
    is_place: np.ndarray

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> PastMoments:
        """Gather what a memory with a clock has noted of what is asked for."""
        assert memory.clock is not None
        num_queries, num_places = len(queries.home), memory.num_furniture
        moments, edges, objects = memory.history.moments, memory.edges, memory.objects
        query, edge = memory.edges_of(queries)
        was_there = edges["num_true"][edge] > 0
        query, edge = query[was_there], edge[was_there]
        cell, of_edge = np.unique(
            query * num_places + edges["furniture"][edge], return_inverse=True
        )
        query, place = np.divmod(cell, num_places)
        states = np.zeros((len(cell), NUM_MOMENTS), dtype=np.uint8)
        np.maximum.at(states, of_edge, moments.get_states(edge))
        times = moments.times[queries.home[query], place]
        # In the order of time: sums do not depend on where a moment is kept.
        order = np.argsort(times, axis=1, kind="stable")
        times = np.take_along_axis(times, order, axis=1)
        states = np.take_along_axis(states, order, axis=1)
        step_hours = compute_step_hours(memory)[queries.home]
        now = compute_week_seconds(memory.clock[queries.home], np.full(num_queries, memory.time))
        since = memory.time - objects["last_observed"][queries.object]
        return cls(
            query=query,
            place=place,
            ago=(memory.time - times) * step_hours[query, None],
            states=np.where((times != NEVER) & (times <= memory.time), states, 0),
            now=now / HOUR_SECONDS,
            lag=np.maximum(since * step_hours, 0.0),
            last=objects["last_furniture"][queries.object].astype(np.int64),
            detection=1 - memory.history.compute_miss_rate(queries.miss_rate)[queries.home],
            is_place=memory.is_furniture[queries.home],
        )

    def compute_since(self) -> np.ndarray:
        """Return hours since the last look at `last`, or since the sighting there, (Q,)."""
        since, is_last = self.lag.copy(), self.place == self.last[self.query]
        ago = np.where(self.states > 0, self.ago, np.inf).min(axis=1)
        np.minimum.at(since, self.query[is_last], ago[is_last])
        return since

    def compute_known_share(self) -> np.ndarray:
        """Return how far the past tells of a thing that has been missed at `last` since, (Q,).

        The longest run of moments that missed it there before it was shown again, plus one, for
        each moment that has missed it since; 1 at most. What was never away for so long is not
        known to come back.
        """
        is_last = self.place == self.last[self.query]
        states = self.states[is_last]
        missed = (states == MISSED).cumsum(axis=1)
        run = missed - np.maximum.accumulate(np.where(states == SHOWN, missed, 0), axis=1)
        came_back = np.flip(np.maximum.accumulate(np.flip(states == SHOWN, 1), axis=1), 1)
        longest = np.where(came_back, run, 0).max(axis=1, initial=0)
        share = np.ones(len(self.now))
        share[self.query[is_last]] = np.minimum((longest + 1) / (run[:, -1] + 1), 1.0)
        return share


@dataclass(frozen=True, slots=True)
class SimilarMoments:
    """What moments like that of Q questions say, at F places and elsewhere.

    Attributes:
        shares: probability of each place and of elsewhere by `KINDS`, (Q, kinds, F + 1); even where
            there are no moments, 0 where a home has no place.
        amount: how many such moments there were at all places, older ones in part, (Q, kinds).
        gain: how much likelier moments of the past are by the others that are alike than by all
            others, nats per moment, (Q, kinds): whether the thing keeps to such a rhythm.
    """

    shares: np.ndarray
    amount: np.ndarray
    gain: np.ndarray


def compare_moments(past: PastMoments) -> SimilarMoments:
    """Compute what similar moments say of questions."""
    query, num_queries = past.query, len(past.now)
    num_places = past.is_place.shape[1]
    is_known, is_shown = past.states > 0, past.states == SHOWN
    weight = np.where(is_known, 0.5 ** (past.ago / _HALF_LIFE), 0.0)
    hour = np.mod(past.now[query, None] - past.ago, 7 * 24)  # of the week
    apart = np.mod(past.ago + 12, 24) - 12
    by_hour = weight * np.exp(-0.5 * (apart / _HOUR_WIDTH) ** 2)
    is_weekend = hour >= 5 * 24
    is_same_day = is_weekend == (past.now[query, None] >= 5 * 24)
    is_last = past.place == past.last[query]
    by_lag = _weigh_lags(past.ago, is_shown, query, is_last, np.maximum(past.lag, _LEAST_LAG))
    weights = np.stack(
        [
            by_hour,
            by_hour * np.where(is_same_day, 1.0, _OTHER_DAY),
            weight * by_lag,
            by_hour * by_lag,
            weight,
        ]
    )  # (kinds, C, n)
    alike, showed = weights.sum(axis=2), (weights * is_shown).sum(axis=2)  # (kinds, C)

    # Looks since the last sighting that missed it lately.
    is_missed = (past.states == MISSED) & (past.ago < past.lag[query, None])
    doubt = np.where(is_missed, 1 - 0.8 * np.exp(-past.ago / _FORGOTTEN), 1.0).prod(axis=1)

    detection = past.detection[query]
    usual = (showed[-1] + 0.02) / (alike[-1] + 1)
    usual /= np.maximum(np.bincount(query, usual, num_queries)[query], 1.0)
    found = (showed + _USUAL * usual * detection) / (detection * alike + _USUAL * detection)
    found[-1] = usual
    total = np.stack([np.bincount(query, each, num_queries) for each in found])
    shares = np.zeros((num_queries, len(KINDS), num_places + 1))
    shares[query, :, past.place] = (found * doubt / np.maximum(total[:, query], 1.0)).T
    shares[:, :, -1] = np.maximum(1 - total, 0.0).T
    shares += _LEAST / (past.is_place.sum(axis=1) + 1)[:, None, None]
    shares[:, :, :-1] *= past.is_place[:, None]
    shares /= shares.sum(axis=2, keepdims=True)

    part, step = hour % 24 // 2, _number_lags(past, is_shown)
    groups = [part, part + 12 * is_weekend, step, step * 4 + part // 3, np.zeros(part.shape)]
    *better, all_as_one = (
        _score_groups(group.astype(np.int64), weight, is_shown) for group in groups
    )
    # What is always there is as likely by all moments as by those of a group.
    better = [score - np.maximum(all_as_one, 0.0) for score in better]
    better.append(np.zeros(len(query)))  # of all moments: what the others are compared with
    gain = np.stack([np.bincount(query, each, num_queries) for each in better], axis=1)
    amount = np.stack([np.bincount(query, each, num_queries) for each in alike], axis=1)
    return SimilarMoments(shares, amount, gain / np.maximum(amount[:, -1:], 1.0))


def _score_groups(group: np.ndarray, weight: np.ndarray, is_shown: np.ndarray) -> np.ndarray:
    """Return how much likelier moments at C places are by the others of their group, (C,).

    Than by all others at the place: the sum over moments, nats. A moment that is alone in its group
    adds nothing, so that a few looks make no rhythm.

    `group` is the number of each, (C, n); `weight` what it counts, 0 for none.
    """
    num_cells, num_groups = len(group), int(group.max(initial=0)) + 1
    cell = np.arange(num_cells)[:, None] * num_groups + group
    size = num_cells * num_groups
    total = np.bincount(cell.ravel(), weight.ravel(), size).reshape(num_cells, num_groups)
    shown = np.bincount(cell.ravel(), (weight * is_shown).ravel(), size).reshape(total.shape)
    number = total.sum(axis=1, keepdims=True)
    gain = np.zeros(num_cells)
    for same in (shown, total - shown):  # each moment, of those that said the same
        usual = (np.maximum(same.sum(axis=1, keepdims=True) - 1, 0.0) + 0.5) / (
            np.maximum(number - 1, 0.0) + 1
        )
        likely = np.maximum(same - 1, 0.0) + _PULL * usual
        likely /= np.maximum(total - 1, 0.0) + _PULL
        gain += (same * np.log(likely / usual)).sum(axis=1)
    return gain


def _number_lags(past: PastMoments, is_shown: np.ndarray) -> np.ndarray:
    """Number for each moment where the thing had been seen before it and how long before, (C, n).

    Places of a thing are numbered from 0; lags are in steps of a factor of two, from half an hour.
    """
    query, num_moments = past.query, past.ago.shape[1]
    nothing = 1e6  # hours: longer than any
    width = np.bincount(query, minlength=len(past.now)).max(initial=1) * num_moments
    rank = compute_rank_in_group(query)
    seen = np.full((len(past.now), width), nothing)
    column = rank[:, None] * num_moments + np.arange(num_moments)
    seen[query[:, None], column] = np.where(is_shown, past.ago, nothing)
    order = np.argsort(seen, axis=1, kind="stable")
    start = np.arange(len(past.now))[:, None] * (2 * nothing)
    ascending = (np.take_along_axis(seen, order, axis=1) + start).ravel()
    wanted = past.ago + start[query]
    number = np.minimum(np.searchsorted(ascending, wanted, side="right"), len(ascending) - 1)
    lag = ascending[number] - wanted
    is_some = (lag > 0) & (ascending[number] - start[query] < nothing)
    place = order.ravel()[number] // num_moments
    bin_ = np.clip(np.log2(np.where(is_some, lag, 1.0) * 2), 0, _NUM_LAGS - 1).astype(np.int64)
    return np.where(is_some, 1 + place * _NUM_LAGS + bin_, 0)


def _weigh_lags(
    ago: np.ndarray, is_shown: np.ndarray, query: np.ndarray, is_last: np.ndarray, lag: np.ndarray
) -> np.ndarray:
    """Weigh moments at C places by how long before them a thing was where it was seen last, (C, n).

    By the sighting there whose distance is most like `lag`, (Q,).

    Args:
        ago: how many hours ago the moments were, (C, n).
        is_shown: whether they showed the thing, bool (C, n).
        query: number of the question, ascending, (C,).
        is_last: whether the place is that where the thing was seen last, bool (C,).
        lag: hours since then, (Q,).
    """
    nothing = 1e9  # hours: no sighting
    seen = np.full((len(lag), ago.shape[1]), nothing)
    cells = np.flatnonzero(is_last)
    seen[query[cells]] = np.sort(np.where(is_shown[cells], ago[cells], nothing), axis=1)
    # One ascending array of all questions, so that one search is enough.
    start = query[:, None] * (2 * nothing)
    ascending = (seen + np.arange(len(lag))[:, None] * (2 * nothing)).reshape(-1)
    wanted = ago + lag[query, None]
    number = np.searchsorted(ascending, wanted + start)
    best = np.zeros(ago.shape)
    for nearest in (number - 1, number):
        sighting = ascending[np.clip(nearest, 0, len(ascending) - 1)] - start
        between = sighting - ago
        is_before = (between > 0) & (sighting < nothing)
        apart = np.log(np.where(is_before, np.maximum(between, 0.05), 1.0) / lag[query, None])
        alike = np.exp(-0.5 * (apart / _LAG_WIDTH) ** 2)
        best = np.maximum(best, np.where(is_before, alike, 0.0))
    return best

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
_LONGEST = 1e6  # hours: longer than any


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
            is_place=memory.mark_places(queries),
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

    def join(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Join the kinds, each as likely as it has made the moments of the past.

        Returns:
            Shares (Q, F + 1), amount (Q,) and gain (Q,).
        """
        score = self.gain * self.amount[:, -1:]
        chance = np.exp(score - score.max(axis=1, keepdims=True))
        chance /= chance.sum(axis=1, keepdims=True)
        shares = (chance[:, :, None] * self.shares).sum(axis=1)
        return shares, (chance * self.amount).sum(axis=1), (chance * self.gain).sum(axis=1)


@dataclass(frozen=True, slots=True)
class _KnownMoments:
    """The n moments of `PastMoments` that say something of the thing.

    Attributes:
        cell: the row of `PastMoments` that each is of, ascending, (n,).
        query: number of the question, ascending, (n,).
        ago: how many hours before the time of the question it was, (n,).
        is_shown: whether it showed the thing, bool (n,).
    """

    cell: np.ndarray
    query: np.ndarray
    ago: np.ndarray
    is_shown: np.ndarray

    @classmethod
    def of(cls, past: PastMoments) -> _KnownMoments:
        """List them."""
        cell, column = np.nonzero(past.states)
        is_shown = past.states[cell, column] == SHOWN
        return cls(cell, past.query[cell], past.ago[cell, column], is_shown)

    def find_before(self, sightings: np.ndarray, lag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the next of some sightings that were longer than `lag` hours before each moment.

        Args:
            sightings: numbers of moments, (m,).
            lag: (n,).

        Returns:
            The sightings by question, the latest first, (m,), and for each moment the position of
            the one found in these, (n,): of a later question, or m, if there is none.
        """
        start = self.query * (2 * _LONGEST)  # one order of all, so that one search is enough
        key = start[sightings] + self.ago[sightings]
        order = np.argsort(key, kind="stable")
        return sightings[order], np.searchsorted(key[order], start + self.ago + lag, side="right")


def compare_moments(past: PastMoments) -> SimilarMoments:
    """Compute what similar moments say of questions."""
    query, num_queries = past.query, len(past.now)
    num_cells, num_places = len(query), past.is_place.shape[1]
    looks = _KnownMoments.of(past)
    cell, ago, is_shown = looks.cell, looks.ago, looks.is_shown
    now = past.now[looks.query]
    weight = np.exp2(ago / -_HALF_LIFE)
    hour = np.mod(now - ago, 7 * 24)  # of the week
    apart = np.mod(ago + 12, 24) - 12
    by_hour = weight * np.exp(-0.5 * (apart / _HOUR_WIDTH) ** 2)
    is_weekend = hour >= 5 * 24
    is_same_day = is_weekend == (now >= 5 * 24)
    by_lag = _weigh_lags(looks, past)
    weights = (
        by_hour,
        by_hour * np.where(is_same_day, 1.0, _OTHER_DAY),
        weight * by_lag,
        by_hour * by_lag,
        weight,
    )
    said = 2 * cell + is_shown
    sums = np.stack([np.bincount(said, each, 2 * num_cells) for each in weights])
    showed = sums[:, 1::2]  # (kinds, C)
    alike = sums[:, ::2] + showed

    # Looks since the last sighting that missed it lately.
    is_missed = ~is_shown & (ago < past.lag[looks.query])
    doubt = np.ones(num_cells)
    np.multiply.at(doubt, cell[is_missed], 1 - 0.8 * np.exp(-ago[is_missed] / _FORGOTTEN))

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

    part, step = (hour % 24 // 2).astype(np.int64), _number_lags(looks, past)
    groups = part, part + 12 * is_weekend, step, step * 4 + part // 3
    all_as_one = _score_groups(np.zeros_like(part), looks, weight, num_cells)
    # What is always there is as likely by all moments as by those of a group.
    better = [
        _score_groups(group, looks, weight, num_cells) - np.maximum(all_as_one, 0.0)
        for group in groups
    ]
    better.append(np.zeros(num_cells))  # of all moments: what the others are compared with
    gain = np.stack([np.bincount(query, each, num_queries) for each in better], axis=1)
    amount = np.stack([np.bincount(query, each, num_queries) for each in alike], axis=1)
    return SimilarMoments(shares, amount, gain / np.maximum(amount[:, -1:], 1.0))


def _score_groups(
    group: np.ndarray, looks: _KnownMoments, weight: np.ndarray, num_cells: int
) -> np.ndarray:
    """Return how much likelier moments at C places are by the others of their group, (C,).

    Than by all others at the place: the sum over moments, nats. A moment that is alone in its group
    adds nothing, so that a few looks make no rhythm.

    `group` is the number of each moment, (n,), `weight` what it counts, (n,).
    """
    num_groups = int(group.max(initial=0)) + 1
    size = num_cells * num_groups
    key = 2 * (looks.cell * num_groups + group) + looks.is_shown
    sums = np.bincount(key, weight, 2 * size)
    missed, shown = sums[::2], sums[1::2]
    of_all = missed + shown
    some = np.flatnonzero(of_all)
    cell, total = some // num_groups, of_all[some]
    number = np.bincount(cell, total, num_cells)
    gain = np.zeros(num_cells)
    for same in (shown[some], missed[some]):  # each moment, of those that said the same
        usual = np.maximum(np.bincount(cell, same, num_cells) - 1, 0.0) + 0.5
        usual /= np.maximum(number - 1, 0.0) + 1
        likely = np.maximum(same - 1, 0.0) + _PULL * usual[cell]
        likely /= np.maximum(total - 1, 0.0) + _PULL
        gain += np.bincount(cell, same * np.log(likely / usual[cell]), num_cells)
    return gain


def _number_lags(looks: _KnownMoments, past: PastMoments) -> np.ndarray:
    """Number for each moment where the thing had been seen before it and how long before, (n,).

    Places of a thing are numbered from 0; lags are in steps of a factor of two, from half an hour.
    """
    sightings, found = looks.find_before(np.flatnonzero(looks.is_shown), np.zeros(len(looks.ago)))
    if not len(sightings):
        return np.zeros(len(looks.ago), dtype=np.int64)
    before = sightings[np.minimum(found, len(sightings) - 1)]
    is_some = (found < len(sightings)) & (looks.query[before] == looks.query)
    lag = np.where(is_some, looks.ago[before] - looks.ago, 1.0)
    place = compute_rank_in_group(past.query)[looks.cell[before]]
    bin_ = np.clip(np.log2(lag * 2), 0, _NUM_LAGS - 1).astype(np.int64)
    return np.where(is_some, 1 + place * _NUM_LAGS + bin_, 0)


def _weigh_lags(looks: _KnownMoments, past: PastMoments) -> np.ndarray:
    """Weigh moments by how long before them a thing was where it was seen last, (n,).

    By the sighting there whose distance is most like the time since it was seen.
    """
    is_last = past.place == past.last[past.query]
    lag = np.maximum(past.lag, _LEAST_LAG)[looks.query]
    sightings, found = looks.find_before(np.flatnonzero(looks.is_shown & is_last[looks.cell]), lag)
    best = np.zeros(len(looks.ago))
    if not len(sightings):
        return best
    for nearest in (found - 1, found):
        before = sightings[np.clip(nearest, 0, len(sightings) - 1)]
        between = looks.ago[before] - looks.ago
        is_before = (between > 0) & (looks.query[before] == looks.query)
        apart = np.log(np.where(is_before, np.maximum(between, 0.05), 1.0) / lag)
        alike = np.exp(-0.5 * (apart / _LAG_WIDTH) ** 2)
        np.maximum(best, np.where(is_before, alike, 0.0), out=best)
    return best

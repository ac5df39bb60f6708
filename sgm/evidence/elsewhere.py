"""How likely a thing is at no known place: one rule, of what the memory counts."""

from __future__ import annotations

import numpy as np

from sgm.arrays.week import NUM_WEEK_HOURS, compute_week_hours
from sgm.belief import compute_miss_over_steps
from sgm.evidence.adaptive_filter import Rates, compute_destinations, list_look_times
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts, compute_hours_per_step
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

ELSEWHERE = 0.1  # share of what is asked for, before any look for it: one search in ten
_GOES_OUT = 0.06  # share of things that go out and come back, before anything was seen
_AT_HOME = 2.0  # looks, beside those of an hour, by what is known of the hours near by
_LEAST = 0.03  # share of its days on which a thing is at home at an hour
_BESIDE = {1: 0.3, 2: 0.15}  # part of a look so many hours before or after
_HOURS = np.arange(24)


def compute_elsewhere(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return how likely things are elsewhere, as of the looks that the memory holds, (Q,).

    By Bayes' rule over three cases: it stayed where it was last seen, it is at any place of the
    home, or it is elsewhere,

        elsewhere = max(.1 moved, out)
        stayed : at any place = 1 - moved : .9 moved

    - moved: how likely it has moved since it was last seen, at the rate at which it is found gone;
      1 if it never was.
    - out: how likely it is out at this hour (`compute_out`).

    Looks since it was last seen, or all, miss it at each place with
    `compute_miss_over_steps`;
    any place counts by the share of its time that it spends there. The memory counts its history.
    """
    counts = ObjectCounts.gather(memory, queries)
    rates = Rates.estimate(memory, queries, counts, HomeSums.of(memory))
    return compute_elsewhere_of(memory, queries, counts, rates)


def compute_elsewhere_of(
    memory: MemoryBatch, queries: Queries, counts: ObjectCounts, rates: Rates
) -> np.ndarray:
    """`compute_elsewhere`, of what was gathered for the same questions, (Q,)."""
    objects, row, home = memory.objects, queries.object, queries.home
    was_seen, seen_at = objects["num_observed"][row] > 0, objects["last_observed"][row]
    hours = compute_hours_per_step(memory, home) * (memory.time - seen_at)
    moved = np.where(was_seen, -np.expm1(-rates.left * hours), 1.0)
    prior = Expected.by_prior(memory, queries)
    usual = compute_destinations(memory, queries, counts, prior)[:, :-1]
    usual = usual / usual.sum(axis=1, keepdims=True)
    look_times, number = list_look_times(memory, queries)
    since = np.where(was_seen, seen_at, -1)[:, None, None]
    num_looks = np.count_nonzero(look_times[number] > since, axis=2)
    num_looks = np.where(was_seen[:, None], num_looks, memory.furniture_num_observed[home])
    miss_rate = memory.history.compute_miss_rate()[home][:, None]
    missed = compute_miss_over_steps(num_looks, miss_rate)  # (Q, F)
    last = objects["last_furniture"][row]
    missed_last = np.where(last >= 0, missed[np.arange(len(row)), last], 1.0)
    elsewhere = np.maximum(ELSEWHERE * moved, compute_out(memory, queries, usual))
    stayed, anywhere = 1 - moved, (1 - ELSEWHERE) * moved
    at_home = (stayed * missed_last + anywhere * (usual * missed).sum(axis=1)) / (stayed + anywhere)
    left = elsewhere / np.maximum(elsewhere + (1 - elsewhere) * at_home, 1e-12)
    return np.minimum(left, 1 - 1e-9)


def compute_out(memory: MemoryBatch, queries: Queries, usual: np.ndarray) -> np.ndarray:
    """Return how likely things are out for a while, by the hour of working day or weekend, (Q,).

    A thing that goes out is at home at each hour for a share s of its days (`_share_at_home`).
    After a day it is out with 1 - s. Sooner, it has gone if s has fallen since it was last seen:

        out = 1 - s(now) / s(then), or 0

    `usual` says what share of its time at home it spends at each place, (Q, F). Without a clock
    nothing is out.
    """
    out = np.zeros(len(queries.home))
    if memory.clock is None or not memory.history.week.is_counted:
        return out
    clock, last = memory.clock[queries.home], memory.objects["last_observed"][queries.object]
    now = compute_week_hours(clock, memory.time)
    asked = np.flatnonzero((last >= 0) & (now >= 0))
    if not len(asked):
        return out
    own, rows = queries.take(asked), np.arange(len(asked))
    goes_out, share = _share_at_home(memory, own, usual[asked])
    share_now = share[rows, now[asked]]
    share_then = share[rows, compute_week_hours(clock[asked], last[asked])]
    hours = (memory.time - last[asked]) * compute_hours_per_step(memory, own.home)
    share_then = np.where(hours < 24, np.maximum(share_then, share_now), 1.0)
    out[asked] = goes_out * (1 - share_now / share_then)
    return out


def _share_at_home(
    memory: MemoryBatch, queries: Queries, usual: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely things go out, (Q,), and on which share of days they are in, (Q, 48).

    The share is that of the looks at an hour of the day that showed it, of those that would if it
    were always in, relative to the hours at which it mostly is. That it goes out at all is likelier
    by how much better the hours beside each hour foretell its looks than "always in" does; counts
    are Poisson ones.
    """
    home, history = queries.home, memory.history
    detection = 1 - history.compute_miss_rate()[home][:, None]
    expected = detection * np.einsum("qf,qfh->qh", usual, history.week.looks[home].astype(float))
    seen = history.week.get_seen(queries.object).astype(float)
    # Looks of one day at one hour say the same: they count for as many as there were days.
    age = memory.time - memory.objects["first_observed"][queries.object]
    days = age * compute_hours_per_step(memory, home) / 24
    most = np.repeat([5 / 7, 2 / 7], NUM_WEEK_HOURS // 2) * days[:, None] + 1
    weight = np.minimum(1.0, most / np.maximum(expected, 1e-9))
    seen, expected = weight * seen, weight * expected
    mostly = (seen + _AT_HOME) / (expected + _AT_HOME)
    expected = expected * np.minimum(mostly.max(axis=1, keepdims=True), 1.0)
    near = (_sum_beside(seen) + _AT_HOME) / (_sum_beside(expected) + _AT_HOME)
    near = np.clip(near, _LEAST, 1.0)
    gain = (seen * np.log(near) + expected * (1 - near)).sum(axis=1)
    odds = _GOES_OUT / (1 - _GOES_OUT) * np.exp(gain.clip(-50, 50))
    share = (seen + _AT_HOME * near) / (expected + _AT_HOME)
    return odds / (1 + odds), np.clip(share, _LEAST, 1.0)


def _sum_beside(counts: np.ndarray) -> np.ndarray:
    """Return, for counts by hour, those of the hours before and after, (Q, NUM_WEEK_HOURS)."""
    days = counts.reshape(len(counts), 2, 24)
    beside = sum(
        part * (days[:, :, _HOURS - hours] + days[:, :, (_HOURS + hours) % 24])
        for hours, part in _BESIDE.items()
    )
    return np.reshape(beside, counts.shape)

"""Things that leave the home and come back: how likely each is out at an hour of the week."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.arrays.grouped import join_groups
from sgm.evidence.adaptive_filter import compute_own_rates
from sgm.evidence.leaving import spread_things
from sgm.evidence.object_counts import compute_hours_per_step
from sgm.evidence.outings_filter import follow_outings
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.memory.week_hours import NUM_WEEK_HOURS

# What people carry when they go out, by the words of a label.
CARRIED = frozenset(
    (
        "keys", "key", "car keys", "house key", "keychain", "phone", "cell phone", "cellphone",
        "mobile phone", "smartphone", "wallet", "purse", "handbag", "backpack", "bag", "briefcase",
        "school bag", "id card", "credit card", "lunch box", "dog leash", "leash", "coat", "jacket",
        "umbrella", "sunglasses", "shoes",
    )
)  # fmt: skip
_MOST_THINGS = 32  # of a home to learn its hours from
# Shares of the time at home of what goes out, by hour, before anything was seen: an assumption.
# People go out on working days, and at weekends less.
_WORKING_DAY = np.full(24, 0.95)
_WORKING_DAY[[8, 17]], _WORKING_DAY[9:17] = 0.6, 0.35
_WEEKEND = np.full(24, 0.95)
_WEEKEND[10:18] = 0.75
_USUAL = np.concatenate([_WORKING_DAY, _WEEKEND])  # (48,)
# All below was chosen by likelihood: 30 simulated homes of seed 2000, recorded household 1.
_USUAL_LOOKS = 12.0  # that this counts for in each hour, beside all things of a home
_HOME_LOOKS = 2.0  # that the home's hours count for, beside the hours near by
_NEAR_LOOKS = 12.0  # that both count for, beside an hour's own
_NEAR, _FURTHER = 0.3, 0.15  # of looks one hour before or after, and two
_OTHER_DAY = 0.1  # of looks at this hour of the other kind of day
_GOES_OUT = 0.06  # of all things
_GOES_OUT_NAMED = 0.25  # of those that people carry, by name
_MIXING = 0.06  # per hour
_DETECTOR_LOOKS = 100.0  # that what is expected of the detector counts for
_ANYWHERE = 0.2  # of where a thing is at home
_ROUNDS = 3  # in which places and hours are distinguished
_LEAST, _MOST = 0.01, 0.97  # of a share of the time at home


def _make_near_by() -> np.ndarray:
    """Return how much looks of each hour count at each other one, (48, 48)."""
    hour = np.arange(24)
    apart = np.abs(hour[:, None] - hour)
    apart = np.minimum(apart, 24 - apart)
    same = _NEAR * (apart == 1) + _FURTHER * (apart == 2)
    other = _OTHER_DAY * np.eye(24)
    return np.block([[same, other], [other, same]])


_NEAR_BY = _make_near_by()  # symmetric


@dataclass(frozen=True, slots=True)
class _Counted:
    """What was counted of n things.

    Attributes:
        seen: looks that showed each by hour, weighed, (n, 48).
        expected: likewise, if it was always at home, (n, 48).
        usual: where it is when it is at home, (n, F).
    """

    seen: np.ndarray
    expected: np.ndarray
    usual: np.ndarray


class Outings:
    """When the things of homes go out and come back.

    A thing is a stay-at-home, or goes out: then it is at home for a share of the time that depends
    on the hour of working days and of weekends. Its share at an hour is the ratio of the looks that
    showed it to those that would have, had it been there: looks at each place count by how much of
    its time at home it spends there. Where it was looked for seldom, its own share gives way to
    those of the hours beside it and to the home's, which all its things tell that go out, and they
    to what is usual. Whether it goes out at all follows from how much likelier its sightings are.

    Between looks it leaves and comes back at the rates that lead from one hour's share to the next,
    and besides it is forgotten at a small rate where it was (`follow_outings`).

    Attributes:
        home_share: how likely a thing of each home that goes out is at home, (H, 48).
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Learn the hours of the homes from what was seen so far."""
        home, rows = _choose_things(memory)
        seen = np.zeros((memory.num_homes, NUM_WEEK_HOURS))
        expected = np.zeros_like(seen)
        if len(rows):
            counted = _count(memory, home, rows)
            usual = np.broadcast_to(_USUAL, (len(home), NUM_WEEK_HOURS))
            goes_out = self._compute_goes_out(memory, rows, counted, usual)
            np.add.at(seen, home, goes_out[:, None] * counted.seen)
            np.add.at(expected, home, goes_out[:, None] * counted.expected)
        seen, expected = seen + seen @ _NEAR_BY, expected + expected @ _NEAR_BY
        self.home_share: np.ndarray = np.minimum(
            (seen + _USUAL_LOOKS * _USUAL) / (expected + _USUAL_LOOKS), 1.0
        )

    def compute(self, memory: MemoryBatch, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
        """Return how likely things are out, and how much likelier that makes what was seen, (Q,).

        Of things never seen, and without a clock, nothing is said: 0 and 1. The memory is that of
        which this was made, or a later state of it.

        Returns:
            Probabilities that things which have not left for good are out; and the likelihood of
            the looks since the last sighting, divided by what it is if nothing ever goes out.
        """
        out, gain = np.zeros(len(queries.home)), np.ones(len(queries.home))
        if memory.clock is None:
            return out, gain
        is_told = memory.objects["num_observed"][queries.object] > 0
        is_told &= ~np.isnan(memory.clock[queries.home, 0])
        home, rows = queries.home[is_told], queries.object[is_told]
        if not len(rows):
            return out, gain
        counted = _count(memory, home, rows)
        of_home = self.home_share[home]
        history, objects = memory.history, memory.objects
        is_out, log_gain = follow_outings(
            _compute_share(counted, of_home), counted.usual, history.look_times[home],
            objects["last_furniture"][rows].astype(np.int64),
            objects["last_observed"][rows].astype(np.int64),
            memory.time, memory.clock[home], compute_own_rates(memory, home, rows)[2],
            history.compute_miss_rate()[home], _MIXING,
        )  # fmt: skip
        goes_out = self._compute_goes_out(memory, rows, counted, of_home)
        likelier = goes_out * np.exp(np.minimum(log_gain, 50.0))
        out[is_told] = likelier * is_out / (likelier + 1 - goes_out)
        gain[is_told] = likelier + 1 - goes_out
        return out, gain

    def _compute_goes_out(
        self, memory: MemoryBatch, rows: np.ndarray, counted: _Counted, of_home: np.ndarray
    ) -> np.ndarray:
        """Return how likely things go out at all, (n,)."""
        labels = memory.labels
        is_named = np.array(
            [labels[label] in CARRIED for label in memory.objects["label"][rows]], dtype=bool
        )
        before = np.where(is_named, _GOES_OUT_NAMED, _GOES_OUT)
        evidence = _compare(counted, of_home)
        odds = before / (1 - before) * np.exp(evidence.clip(-50, 50))
        return odds / (1 + odds)


def _choose_things(memory: MemoryBatch) -> tuple[np.ndarray, np.ndarray]:
    """Return home and row of things that were seen in homes with a clock, some of each home."""
    if memory.clock is None:
        none = np.zeros(0, dtype=np.int64)
        return none, none
    objects = memory.objects
    has_clock = ~np.isnan(memory.clock[:, 0])
    rows = np.flatnonzero((objects["num_observed"] > 0) & has_clock[objects["home"]])
    rows = spread_things(memory, rows, _MOST_THINGS)
    return objects["home"][rows], rows


def _count(memory: MemoryBatch, home: np.ndarray, rows: np.ndarray) -> _Counted:
    """Count the looks that showed things by hour, and those that would have."""
    history, is_place = memory.history, memory.is_furniture[home]
    looks = history.week.looks  # (H, F, 48)
    looks = (looks if len(looks) == 1 else looks[home]).astype(float)
    seen = history.week.get_seen(rows).astype(float)
    number, edge = join_groups(rows, memory.edges["object"], len(memory.objects))
    num_true = np.zeros(is_place.shape)
    np.add.at(num_true, (number, memory.edges["furniture"][edge]), memory.edges["num_true"][edge])
    even = is_place / is_place.sum(axis=1, keepdims=True)
    detection = 1 - history.compute_miss_rate()[home][:, None]
    days = _count_days(memory, home, rows)
    share = np.ones((len(rows), NUM_WEEK_HOURS))
    for turn in range(_ROUNDS):
        rate = num_true / (_sum_hours(looks, share) + 1)
        usual = rate + 1e-9 * even
        usual /= usual.sum(axis=1, keepdims=True)
        near = _sum_places(looks, usual)
        level = (seen.sum(axis=1, keepdims=True) + _DETECTOR_LOOKS * detection) / (
            (near * share).sum(axis=1, keepdims=True) + _DETECTOR_LOOKS
        )
        expected = level * near
        # Looks of one day at one hour say the same: they count for as many as there were days.
        weight = np.minimum(1.0, days / np.maximum(expected, 1e-9))
        counted = _Counted(seen * weight, expected * weight, usual)
        if turn < _ROUNDS - 1:
            share = _compute_share(counted, _USUAL)
    return _Counted(
        counted.seen, counted.expected, (1 - _ANYWHERE) * counted.usual + _ANYWHERE * even
    )


def _sum_hours(looks: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Weigh looks (n or 1, F, 48) by the hour, (n, 48), and add them up: (n, F)."""
    if len(looks) == 1:
        return _multiply(share, looks[0])
    summed: np.ndarray = np.einsum("nfb,nb->nf", looks, share)
    return summed


def _sum_places(looks: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """Weigh looks (n or 1, F, 48) by the place, (n, F), and add them up: (n, 48)."""
    if len(looks) == 1:
        return _multiply(usual, np.ascontiguousarray(looks[0].T))
    summed: np.ndarray = np.einsum("nfb,nf->nb", looks, usual)
    return summed


def _multiply(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the product of each of n rows and each of m others, (n, D), (m, D) -> (n, m).

    Added up in one order whatever n is, so that no thing's depends on what is asked for beside it.
    """
    return np.einsum("nd,md->nm", rows, others)


def _count_days(memory: MemoryBatch, home: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return on about how many days of each kind things were known, (n, 48)."""
    age = memory.time - memory.objects["first_observed"][rows]
    days = age * compute_hours_per_step(memory, home) / 24
    share = np.repeat([5 / 7, 2 / 7], 24)
    return np.ceil(days)[:, None] * share + 1


def _expect_share(counted: _Counted, of_home: np.ndarray) -> np.ndarray:
    """Return the share of the time at home that the hours near by and the home tell, (n, 48)."""
    seen, expected = _multiply(counted.seen, _NEAR_BY), _multiply(counted.expected, _NEAR_BY)
    return np.clip((seen + _HOME_LOOKS * of_home) / (expected + _HOME_LOOKS), 0.03, 1.0)


def _compute_share(counted: _Counted, of_home: np.ndarray) -> np.ndarray:
    """Return the share of the time at home of things that go out, by hour, (n, 48)."""
    share = _expect_share(counted, of_home)
    seen, expected = counted.seen + _NEAR_LOOKS * share, counted.expected + _NEAR_LOOKS
    return np.clip(seen / expected, _LEAST, _MOST)


def _compare(counted: _Counted, of_home: np.ndarray) -> np.ndarray:
    """Return how much likelier sightings are if things go out, in nats, (n,).

    Each hour is judged by what the others say of it: counts of the Poisson distribution.
    """
    share = _expect_share(counted, of_home)
    return (counted.seen * np.log(share) + counted.expected * (1 - share)).sum(axis=1)


def join_left(left: np.ndarray, out: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Return how likely things are out of the home, for good or for a while, (Q,).

    By Bayes' rule over three cases: it has left for good, it is out, it is in. The probability of
    the first, as `Leaving` says, was computed as if nothing ever came back; what was seen is
    likelier by the gain if it does. That and the second are of `Outings.compute`, (Q,) each.
    """
    stays = (1 - left) * gain
    return (left + stays * out) / (left + stays)

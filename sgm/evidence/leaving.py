"""How likely a thing has left the home for good, learnt from all things of the home."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.arrays.relations import sum_relations
from sgm.evidence.adaptive_filter import (
    compute_crossing,
    compute_own_rates,
    list_look_times,
)
from sgm.evidence.look_filter import follow_left
from sgm.evidence.object_counts import compute_hours_per_step, count_sightings
from sgm.memory.home_history import NUM_LOOKS_KEPT
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

# Which share of the moves of a home may lead out of it, for good.
_SHARES = 10.0 ** np.arange(-2.5, 1.6, 0.5)
# Before anything was seen: few do, and nothing is ruled out.
_USUAL = 0.05
_PRIOR = np.sqrt(_SHARES / _USUAL) / (1 + _SHARES / _USUAL) ** 2
_COUNTED = 0.5  # of what the things of a home say in sum: they do not leave one by one
# Things of a home to learn from, and how many where every place and look of each were followed.
_LEAST_THINGS, _MOST_THINGS = 4, 64
_MOST_WORK = 2**25


class Leaving:
    """Whether things leave a home for good, and how likely each has left since it was last seen.

    A thing leaves for good at a share of the rate at which it moves; the share is the home's, and
    is learnt from how long all its things have been seen and from what the looks since did not
    find (`follow_left`): who was last seen long ago, and is at no place that was looked at since,
    has left, or looks miss it.

    Attributes:
        weights: probability of each share in each home, (H, J).
    """

    def __init__(self, memory: MemoryBatch, asked: Queries | None = None) -> None:
        """Learn from what was seen so far; the memory must count its history.

        The things that `compute` will be `asked` for first are followed in one call with those that
        are learnt from.
        """
        things = _choose_things(memory)
        followed = things if asked is None else things.join(asked)
        left, leaving = _follow(memory, followed)
        num_things = len(things.home)
        self._asked, self._asked_left = asked, left[num_things:]
        left, leaving = left[:num_things], leaving[:num_things]
        age = memory.time - memory.objects["first_observed"][things.object]
        hours = age * compute_hours_per_step(memory, things.home)
        likelihood = -leaving * hours[:, None] - np.log1p(-left)
        total = np.zeros((memory.num_homes, len(_SHARES)))
        np.add.at(total, things.home, _COUNTED * likelihood)
        total += np.log(_PRIOR)
        weights = np.exp(total - total.max(axis=1, keepdims=True))
        self.weights: np.ndarray = weights / weights.sum(axis=1, keepdims=True)

    def compute(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return how likely things that were seen have left for good, (Q,); 0 for the others.

        The memory is that of which this was made, or, for other things than those that it was made
        for, a later state of it.
        """
        left = self._asked_left if queries is self._asked else _follow(memory, queries)[0]
        was_seen = memory.objects["num_observed"][queries.object] > 0
        return np.where(was_seen, (left * self.weights[queries.home]).sum(axis=1), 0.0)


def _choose_things(memory: MemoryBatch) -> Queries:
    """Return things that were seen in each home, spread over the order in which that was.

    Where there are thousands of places, fewer: following one thing costs places times looks.
    """
    work = NUM_LOOKS_KEPT * memory.num_furniture**2
    most = max(_LEAST_THINGS, min(_MOST_THINGS, _MOST_WORK // max(work, 1)))
    rows = spread_things(memory, np.flatnonzero(memory.objects["num_observed"] > 0), most)
    home = memory.objects["home"][rows]
    return Queries(home, rows, memory.place_prior.rows(home, memory.objects["type"][rows]))


def spread_things(memory: MemoryBatch, rows: np.ndarray, most: int) -> np.ndarray:
    """Return so many rows of objects of each home at most, spread over their order, by home."""
    if memory.num_homes == 1:
        return rows[:: max(-(-len(rows) // most), 1)]
    rows = rows[np.argsort(memory.objects["home"][rows], kind="stable")]
    home = memory.objects["home"][rows]
    every = -(-np.bincount(home) // most)[home]
    return rows[compute_rank_in_group(home) % every == 0]


def _follow(memory: MemoryBatch, things: Queries) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely each thing has left, for each share, and the rates that means, (Q, J).

    It may leave at any time; the looks since, which did not find it, are as likely as the filter of
    the home's own rates says if it stayed, and certain if it left. What is in the home, at a place
    that is not known, is as good as gone.
    """
    objects, home, row = memory.objects, things.home, things.object
    hours, _, own = compute_own_rates(memory, home, row)
    leaving = own[:, None] * _SHARES
    left = follow_left(
        count_sightings(memory, row), sum_relations(things.prior), memory.furniture_room[home],
        memory.room_label.shape[1], *list_look_times(memory, things),
        objects["last_furniture"][row], objects["last_observed"][row], memory.time, hours, own,
        compute_crossing(memory)[home], memory.history.compute_miss_rate()[home], leaving,
    )  # fmt: skip
    return np.minimum(left, 1 - 1e-9), leaving

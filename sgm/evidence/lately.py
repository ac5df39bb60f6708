"""What looks have found changed in a home over the last minutes, hours and days.

Things move in bursts, while people are there. What was found moved, or gone from where it was,
tells that they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.rows import add_in_order
from sgm.evidence.object_counts import compute_hours_per_step
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

SPANS = {"minutes": 1 / 6, "hours": 1.0, "days": 24.0}  # hours after which an event counts 1 / e


class Lately(NamedTuple):
    """Events of the latest time; each counts exp(-age / span), for every one of `SPANS`.

    Attributes:
        changes: in the home, things that a look found moved or gone, (S, Q).
        looks: in the home, (S, Q).
        changes_at: at each place, (S, Q, F).
        hours_since_moved: since the thing itself was found moved, (Q,); infinite for never.
    """

    changes: np.ndarray
    looks: np.ndarray
    changes_at: np.ndarray
    hours_since_moved: np.ndarray

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> Lately:
        """Gather what has changed in the homes that are asked."""
        of_homes = _Changes.of(memory)
        home, moved = queries.home, memory.objects["last_moved"][queries.object]
        hours = (memory.time - moved) * compute_hours_per_step(memory, home)
        at = of_homes.changes_at[:, home]
        return cls(
            changes=add_in_order(at)[..., 0],
            looks=of_homes.looks[:, home],
            changes_at=at,
            hours_since_moved=np.where(moved >= 0, hours, np.inf),
        )


class _Changes(NamedTuple):
    """Of H homes: `looks` (S, H), `changes_at` (S, H, F)."""

    looks: np.ndarray
    changes_at: np.ndarray

    @classmethod
    def of(cls, memory: MemoryBatch) -> _Changes:
        """Count them; once, of a memory whose content does not change."""
        kept = memory.derived
        if kept is None:
            return cls._compute(memory)
        if (cls, memory.time) not in kept:
            kept[cls, memory.time] = cls._compute(memory)
        changes: _Changes = kept[cls, memory.time]
        return changes

    @classmethod
    def _compute(cls, memory: MemoryBatch) -> _Changes:
        objects, edges = memory.objects, memory.edges
        num_homes, num_places = memory.num_homes, memory.num_furniture
        hours = compute_hours_per_step(memory, np.arange(num_homes))
        came = np.flatnonzero((objects["last_moved"] >= 0) & (objects["last_furniture"] >= 0))
        left = np.flatnonzero((edges["last_changed"] >= 0) & ~edges["is_true"])
        home = np.concatenate([objects["home"][came], edges["home"][left]])
        place = np.concatenate([objects["last_furniture"][came], edges["furniture"][left]])
        when = np.concatenate([objects["last_moved"][came], edges["last_changed"][left]])
        age = (memory.time - when) * hours[home]
        times = memory.history.look_times  # (H, F, L)
        look_age = (memory.time - times) * hours[:, None, None]
        changes_at = np.empty((len(SPANS), num_homes, num_places))
        looks = np.empty((len(SPANS), num_homes))
        for number, span in enumerate(SPANS.values()):
            weight = np.exp(-age / span)
            counts = np.bincount(
                home.astype(np.int64) * num_places + place, weight, num_homes * num_places
            )
            changes_at[number] = counts.reshape(num_homes, num_places)
            weight = (np.exp(-look_age / span) * (times >= 0)).reshape(num_homes, -1)
            looks[number] = add_in_order(weight)[:, 0]
        return cls(looks=looks, changes_at=changes_at)

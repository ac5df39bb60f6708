"""The counters of objects that are asked for, by place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.evidence.object_counts_kernel import gather_counts
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_NO_HOURS = np.zeros((2, 0, NUM_HOURS), dtype=np.uint16)


@dataclass(frozen=True, slots=True)
class ObjectCounts:
    """What was seen of Q objects at F furniture nodes, "in" and "onTop" taken together.

    Attributes:
        num_true: how often it was seen there, (Q, F).
        last_true: when last, -1 for never, (Q, F).
        num_absent: looks since then, all of them where it was never seen, (Q, F); of a look that
            had a part of the furniture in view, that part.
        num_left: looks that found it gone from there, (Q, F).
        time_true: time steps for which it was known to be there, (Q, F).
        num_known: looks since it was first seen there, (Q, F).
        last_known: when the latest of them was, -1 for none, (Q, F).
        is_true: whether it showed the object, bool (Q, F).
        hours: by hour of day how often it was seen there, and looks since it was first seen there
            that did not show it, (2, Q, F, NUM_HOURS); None if no home has a clock.
    """

    num_true: np.ndarray
    last_true: np.ndarray
    num_absent: np.ndarray
    num_left: np.ndarray
    time_true: np.ndarray
    num_known: np.ndarray
    last_known: np.ndarray
    is_true: np.ndarray
    hours: np.ndarray | None

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> ObjectCounts:
        """Gather the counters of the query objects."""
        edges, has_hours = memory.edges, memory.clock is not None
        *counts, missed, is_true, hours = gather_counts(
            queries.object.astype(np.int64), len(memory.objects), memory.num_furniture,
            edges["object"], edges["furniture"], edges["num_true"], edges["num_changed"],
            edges["is_true"], edges["time_true"], edges["num_observed"], edges["last_true"],
            edges["last_observed"], edges["missed"],
            memory.history.edge_hours if has_hours else _NO_HOURS, NUM_HOURS if has_hours else 0,
        )  # fmt: skip
        num_true, last_true, num_left, time_true, num_known, last_known = counts
        num_looks = memory.furniture_num_observed[queries.home]
        return cls(
            num_true, last_true, np.minimum(missed, num_looks), num_left, time_true, num_known,
            last_known, is_true, hours if has_hours else None,
        )  # fmt: skip


def compute_hours_per_step(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return how long a time step is in hours, one where it is unknown, (n,) -> (n,)."""
    if memory.clock is None:
        return np.ones(len(home))
    seconds = memory.clock[home, 1]
    return np.where(np.isnan(seconds), 3600.0, seconds) / 3600


def compute_hour(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return the hour of day in homes, in [0, 24), nan where it is unknown, (n,) -> (n,)."""
    if memory.clock is None:
        return np.full(len(home), np.nan)
    return np.mod(memory.clock[home, 0] / 3600 + memory.time * memory.clock[home, 1] / 3600, 24)

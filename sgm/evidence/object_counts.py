"""The counters of objects that are asked for, by place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.memory.columns import NEVER
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries


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
        shape = (len(queries.home), memory.num_furniture)
        query, edge = memory.edges_of(queries)
        edges = memory.edges
        is_true = edges["num_true"][edge] > 0
        query, edge = query[is_true], edge[is_true]
        place = (query, edges["furniture"][edge])
        sums = np.zeros((*shape, 3), dtype=np.int32)  # one call for all: an object has few edges
        own = edges["num_true"][edge], count_left(memory, edge), edges["time_true"][edge]
        np.add.at(sums, place, np.stack(own, axis=1))
        most = np.full((*shape, 4), NEVER, dtype=np.int32)
        names = ("num_observed", "last_true", "last_observed", "is_true")
        np.maximum.at(most, place, np.stack([edges[name][edge] for name in names], axis=1))
        num_true, num_left, time_true = sums.transpose(2, 0, 1)
        num_known, last_true, last_known, is_now = most.transpose(2, 0, 1)
        num_absent = np.full(shape, np.inf)
        np.minimum.at(num_absent, place, edges["missed"][edge])
        num_absent = np.minimum(num_absent, memory.furniture_num_observed[queries.home])
        hours = None
        if memory.clock is not None:
            hours = np.zeros((2, *shape, NUM_HOURS), dtype=np.float32)
            seen, gone = memory.history.get_edge_hours(edge)
            np.add.at(hours[0], place, seen)
            np.maximum.at(hours[1], place, gone)
        return cls(
            num_true, last_true, num_absent, num_left, time_true, np.maximum(num_known, 0),
            last_known, is_now > 0, hours,
        )  # fmt: skip


def count_left(memory: MemoryBatch, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
    """Count the looks at edges that found them false after one that had found them true, (n,).

    Edges become true and false in turn, so that half of their changes were of this kind.
    """
    edges = memory.edges
    num_left: np.ndarray = (edges["num_changed"][rows] + ~edges["is_true"][rows]) // 2
    return num_left


def compute_hours_per_step(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return how long a time step is in hours, one where nobody knows, (n,) -> (n,)."""
    if memory.clock is None:
        return np.ones(len(home))
    seconds = memory.clock[home, 1]
    return np.where(np.isnan(seconds), 3600.0, seconds) / 3600


def compute_hour(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return the hour of day in homes, in [0, 24), nan where nobody knows, (n,) -> (n,)."""
    if memory.clock is None:
        return np.full(len(home), np.nan)
    return np.mod(memory.clock[home, 0] / 3600 + memory.time * memory.clock[home, 1] / 3600, 24)

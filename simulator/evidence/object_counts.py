"""The counters of objects that are asked for, by place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.memory.columns import NEVER
from simulator.memory.home_history import NUM_HOURS
from simulator.memory.memory_batch import MemoryBatch
from simulator.memory.queries import Queries


@dataclass(frozen=True, slots=True)
class ObjectCounts:
    """What was seen of Q objects at F furniture nodes, "in" and "onTop" taken together.

    Attributes:
        num_true: how often it was seen there, (Q, F).
        last_true: when last, -1 for never, (Q, F).
        num_absent: looks since then, all of them where it was never seen, (Q, F); of a look that
            had a part of the furniture in view, that part.
        hours: how often it was seen there by hour of day, (Q, F, NUM_HOURS); None if no home has a
            clock.
    """

    num_true: np.ndarray
    last_true: np.ndarray
    num_absent: np.ndarray
    hours: np.ndarray | None

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> ObjectCounts:
        """Gather the counters of the query objects."""
        shape = (len(queries.home), memory.num_furniture)
        query, edge = memory.edges_of(queries)
        is_true = memory.edges["num_true"][edge] > 0
        query, edge = query[is_true], edge[is_true]
        place = (query, memory.edges["furniture"][edge])
        num_true = np.zeros(shape, dtype=np.int32)
        np.add.at(num_true, place, memory.edges["num_true"][edge])
        last_true = np.full(shape, NEVER, dtype=np.int32)
        np.maximum.at(last_true, place, memory.edges["last_true"][edge])
        num_absent = np.full(shape, np.inf)
        np.minimum.at(num_absent, place, memory.edges["missed"][edge])
        num_absent = np.minimum(num_absent, memory.furniture_num_observed[queries.home])
        hours = None
        if memory.clock is not None:
            hours = np.zeros((*shape, NUM_HOURS), dtype=np.float32)
            np.add.at(hours, place, memory.history.get_edge_hours(edge))
        return cls(num_true, last_true, num_absent, hours)


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

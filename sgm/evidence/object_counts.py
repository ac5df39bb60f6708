"""The counters of objects that are asked for, by place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.both_relations import choose_relations
from sgm.arrays.grouped import join_groups
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries


class ObjectCounts(NamedTuple):
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
            that did not show it, (2, Q, F, NUM_HOURS); no hours if no home has a clock.
    """

    num_true: np.ndarray
    last_true: np.ndarray
    num_absent: np.ndarray
    num_left: np.ndarray
    time_true: np.ndarray
    num_known: np.ndarray
    last_known: np.ndarray
    is_true: np.ndarray
    hours: np.ndarray

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> ObjectCounts:
        """Gather the counters of the query objects, which may be asked for twice."""
        shape = len(queries.object), memory.num_furniture
        edges = memory.edges
        query, edge = join_groups(queries.object, edges["object"], memory.objects.num_rows)
        was_true = edges["num_true"][edge] > 0
        query, edge = query[was_true], edge[was_true]
        at = query * shape[1] + edges["furniture"][edge]
        is_true = edges["is_true"][edge]

        def gather(ufunc: np.ufunc, value: np.ndarray, empty: float = 0) -> np.ndarray:
            """Reduce the values of edges by place, (k,) -> (Q, F)."""
            reduced = np.full(shape[0] * shape[1], empty, dtype=value.dtype)
            ufunc.at(reduced, at, value)
            return reduced.reshape(shape)

        # Edges become true and false in turn: half of their changes were of this kind.
        num_left = (edges["num_changed"][edge] + ~is_true) // 2
        num_missed = gather(np.minimum, edges["missed"][edge].astype(float), np.inf)
        return cls(
            num_true=gather(np.add, edges["num_true"][edge]),
            last_true=gather(np.maximum, edges["last_true"][edge], -1),
            num_absent=np.minimum(num_missed, memory.furniture_num_observed[queries.home]),
            num_left=gather(np.add, num_left),
            time_true=gather(np.add, edges["time_true"][edge]),
            num_known=gather(np.maximum, edges["num_observed"][edge]),
            last_known=gather(np.maximum, edges["last_observed"][edge], -1),
            is_true=gather(np.logical_or, is_true, False),
            hours=_gather_hours(memory, edge, at, shape),
        )


def _gather_hours(
    memory: MemoryBatch, edge: np.ndarray, at: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    """Return `ObjectCounts.hours` of edges, (k,), that belong to so many questions and places.

    `at` is the number of question and place of each, in 0..Q F - 1, (k,).
    """
    if memory.clock is None:
        return np.zeros((2, *shape, 0), dtype=np.float32)
    hours = np.zeros((2, shape[0] * shape[1], NUM_HOURS), dtype=np.float32)
    seen, gone = memory.history.get_edge_hours(edge)
    np.add.at(hours[0], at, seen)
    np.maximum.at(hours[1], at, gone)
    return hours.reshape(2, *shape, NUM_HOURS)


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


def choose_edges(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Choose a relation for Q objects at each of F places: seen most often so, else likelier.

    Returns:
        Prior weight in it, and the relation, float32 (Q, F, 2).
    """
    edges, prior = memory.edges, queries.prior.copy()
    num_true = np.full(prior.shape, -1, dtype=np.int32)
    query, edge = join_groups(queries.object, edges["object"], memory.objects.num_rows)
    at = query, edges["furniture"][edge], edges["relation"][edge]
    num_true[at], prior[at] = edges["num_true"][edge], edges["prior"][edge]
    likelier = choose_relations(queries.prior, last=True)
    relation = np.where((num_true < 0).all(axis=2), likelier, choose_relations(num_true))
    weight = np.take_along_axis(prior, relation[..., None], axis=2)[..., 0]
    return np.stack([weight, relation], axis=2).astype(np.float32)

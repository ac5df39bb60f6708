"""The counters of objects that are asked for, by place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.kernel import kernel
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_NO_HOURS = np.zeros((2, 0, NUM_HOURS), dtype=np.uint16)


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
        """Gather the counters of the query objects."""
        edges, has_hours = memory.edges, memory.clock is not None
        *counts, missed, is_true, hours = _gather_counts(
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
            last_known, is_true, hours,
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


@kernel
def _gather_counts(
    query_object: np.ndarray,
    num_objects: int,
    num_places: int,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_num_true: np.ndarray,
    edge_num_changed: np.ndarray,
    edge_is_true: np.ndarray,
    edge_time_true: np.ndarray,
    edge_num_observed: np.ndarray,
    edge_last_true: np.ndarray,
    edge_last_observed: np.ndarray,
    edge_missed: np.ndarray,
    edge_hours: np.ndarray,
    num_hours: int,
) -> tuple[np.ndarray, ...]:
    """Gather the counters of rows of objects, which may be asked for twice, int64 (Q,).

    What begins with `edge` are columns of edges, (E,). `edge_hours` has the first of them by hour
    of day: sightings, and looks that did not show what had been seen there, uint16 (2, E', bins);
    none in homes without a clock. `num_hours` is 0 to leave hours out.

    Returns:
        num_true, last_true, num_left, time_true, num_known, last_known, int32 (Q, F) each; parts of
        looks that missed it, infinite where it was never seen, float64 (Q, F); whether it is true,
        bool (Q, F); hours, float32 (2, Q, F, num_hours).
    """
    num_queries = len(query_object)
    num_true = np.zeros((num_queries, num_places), dtype=np.int32)
    last_true = np.full((num_queries, num_places), -1, dtype=np.int32)
    num_left = np.zeros((num_queries, num_places), dtype=np.int32)
    time_true = np.zeros((num_queries, num_places), dtype=np.int32)
    num_known = np.zeros((num_queries, num_places), dtype=np.int32)
    last_known = np.full((num_queries, num_places), -1, dtype=np.int32)
    missed = np.full((num_queries, num_places), np.inf)
    is_true = np.zeros((num_queries, num_places), dtype=np.bool_)
    hours = np.zeros((2, num_queries, num_places, num_hours), dtype=np.float32)
    latest, before = _chain_queries(query_object, num_objects)
    for edge in range(len(edge_object)):
        query = latest[edge_object[edge]]
        if query < 0 or edge_num_true[edge] == 0:
            continue
        place = edge_place[edge]
        counted = min(edge, edge_hours.shape[1] - 1)
        while query >= 0:
            num_true[query, place] += edge_num_true[edge]
            time_true[query, place] += edge_time_true[edge]
            # Edges become true and false in turn: half of their changes were of this kind.
            num_left[query, place] += (edge_num_changed[edge] + (not edge_is_true[edge])) // 2
            last_true[query, place] = max(last_true[query, place], edge_last_true[edge])
            num_known[query, place] = max(num_known[query, place], edge_num_observed[edge])
            last_known[query, place] = max(last_known[query, place], edge_last_observed[edge])
            missed[query, place] = min(missed[query, place], edge_missed[edge])
            if edge_is_true[edge]:
                is_true[query, place] = True
            if counted >= 0:
                for hour in range(num_hours):
                    hours[0, query, place, hour] += edge_hours[0, counted, hour]
                    hours[1, query, place, hour] = max(
                        hours[1, query, place, hour], edge_hours[1, counted, hour]
                    )
            query = before[query]
    return (
        num_true, last_true, num_left, time_true, num_known, last_known, missed, is_true, hours,
    )  # fmt: skip


@kernel
def count_sightings(
    query_object: np.ndarray,
    num_objects: int,
    num_places: int,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_num_true: np.ndarray,
) -> np.ndarray:
    """Count the sightings of Q objects at F places: `ObjectCounts.num_true` alone."""
    num_true = np.zeros((len(query_object), num_places), dtype=np.int32)
    latest, before = _chain_queries(query_object, num_objects)
    for edge in range(len(edge_object)):
        query = latest[edge_object[edge]]
        while query >= 0:
            num_true[query, edge_place[edge]] += edge_num_true[edge]
            query = before[query]
    return num_true


@kernel
def choose_edges(
    query_object: np.ndarray,
    num_objects: int,
    query_prior: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_relation: np.ndarray,
    edge_num_true: np.ndarray,
    edge_prior: np.ndarray,
) -> np.ndarray:
    """Choose a relation for Q objects at each of F places: seen most often so, else likelier.

    `query_object` are rows of objects, which may be asked for twice, int64 (Q,), `query_prior` the
    prior weight of both relations, (Q, F, 2); what begins with `edge` are columns of edges, (E,).

    Returns:
        Prior weight in it, and the relation, float32 (Q, F, 2).
    """
    num_queries, num_places = query_prior.shape[:2]
    num_true = np.full((num_queries, num_places, 2), -1, dtype=np.int32)
    prior = query_prior.copy()
    latest, before = _chain_queries(query_object, num_objects)
    for edge in range(len(edge_object)):
        query = latest[edge_object[edge]]
        while query >= 0:
            num_true[query, edge_place[edge], edge_relation[edge]] = edge_num_true[edge]
            prior[query, edge_place[edge], edge_relation[edge]] = edge_prior[edge]
            query = before[query]
    chosen = np.empty((num_queries, num_places, 2), dtype=np.float32)
    for query in range(num_queries):
        for place in range(num_places):
            inside, on_top = num_true[query, place]
            is_on_top = on_top > inside
            if inside < 0 and on_top < 0:
                is_on_top = query_prior[query, place, 0] <= query_prior[query, place, 1]
            chosen[query, place, 0] = prior[query, place, 1 if is_on_top else 0]
            chosen[query, place, 1] = is_on_top
    return chosen


@kernel
def _chain_queries(query_object: np.ndarray, num_objects: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the last query for each object, (O,), and the one before each, -1 for none, (Q,)."""
    latest = np.full(num_objects, -1, dtype=np.int64)
    before = np.empty(len(query_object), dtype=np.int64)
    for query in range(len(query_object)):
        before[query] = latest[query_object[query]]
        latest[query_object[query]] = query
    return latest, before

"""The counters of objects that are asked for, summed up by place."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def gather_counts(
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
    """Gather the counters of Q objects at F places; see `sgm.evidence.object_counts`.

    Args:
        query_object: row of each object, which may be asked for twice, int64 (Q,).
        num_objects: rows there are.
        num_places: F.
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_num_true: likewise.
        edge_num_changed: likewise.
        edge_is_true: likewise.
        edge_time_true: likewise.
        edge_num_observed: likewise.
        edge_last_true: likewise.
        edge_last_observed: likewise.
        edge_missed: likewise.
        edge_hours: of the first edges by hour of day, sightings, and looks that did not show what
            had been seen there, uint16 (2, E', num_hours); none in homes without a clock.
        num_hours: 0 to leave hours out.

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
    """Count the sightings of Q objects at F places: `num_true` of `gather_counts` alone."""
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

    Args:
        query_object: row of each object, which may be asked for twice, int64 (Q,).
        num_objects: rows there are.
        query_prior: prior weight of both relations, (Q, F, 2).
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_relation: likewise.
        edge_num_true: likewise.
        edge_prior: likewise.

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

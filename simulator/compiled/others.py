"""What the other objects of a home say about one that is asked for."""

from __future__ import annotations

import math

import numpy as np

from simulator.compiled.kernel import kernel

_ALIKE = 0.3  # cosine of the sightings by place from which an object counts as a companion


@kernel
def gather_others(
    query_home: np.ndarray,
    query_object: np.ndarray,
    seen: np.ndarray,
    age_rate: np.ndarray,
    now: int,
    object_label: np.ndarray,
    object_last_place: np.ndarray,
    object_last_time: np.ndarray,
    edge_order: np.ndarray,
    edge_start: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_num_true: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gather, for Q questions, where things of the same name and companions were seen.

    Args:
        query_home: (Q,).
        query_object: (Q,).
        seen: sightings of the object asked for by place, float64 (Q, F).
        age_rate: at which a sighting of a companion loses its worth, per step, (Q,).
        now: the present time step.
        object_label: column of objects, (O,).
        object_last_place: likewise.
        object_last_time: likewise.
        edge_order: rows of edges, home by home, (E,).
        edge_start: first entry of each home in `edge_order`, and the end, (H + 1,).
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_num_true: likewise.

    Returns:
        Sightings of objects of the same name, (Q, F); companions that were seen last at a place,
        weighted by likeness and by how fresh that is, (Q, F); share of the sightings of companions
        by place, weighted by likeness, (Q, F).
    """
    num_queries, num_places = seen.shape
    same = np.zeros((num_queries, num_places))
    fresh = np.zeros((num_queries, num_places))
    often = np.zeros((num_queries, num_places))
    num_objects = len(object_label)
    total = np.zeros(num_objects)
    square = np.zeros(num_objects)
    product = np.zeros(num_objects)
    for query in range(num_queries):
        home, asked = query_home[query], query_object[query]
        own_square = 0.0
        for place in range(num_places):
            own_square += seen[query, place] ** 2
        begin, end = edge_start[home], edge_start[home + 1]
        for position in range(begin, end):
            row = edge_object[edge_order[position]]
            total[row] = square[row] = product[row] = 0.0
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            total[row] += count
            square[row] += count * count
            product[row] += count * seen[query, place]
            if row != asked and object_label[row] == object_label[asked]:
                same[query, place] += count
        if own_square == 0:
            continue
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            if row == asked or count == 0:
                continue
            alike = product[row] / math.sqrt(square[row] * own_square)
            if alike > _ALIKE:
                often[query, place] += alike * count / total[row]
                if place == object_last_place[row]:
                    age = now - object_last_time[row]
                    fresh[query, place] += alike * math.exp(-age_rate[query] * age)
    return same, fresh, often

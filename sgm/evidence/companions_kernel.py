"""What the other objects of a home say about one that is asked for."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel

_LATELY = 10  # times as fast as a sighting of a companion, one out of place loses its weight
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
    likeness: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Gather, for Q questions, where things of the same name and companions were seen.

    What begins with `object` are columns of objects, (O,), with `edge` those of edges, (E,).
    `edge_order` has the rows of edges home by home, (E,), and `edge_start` the first entry of each
    home there, and the end, (H + 1,). `seen` are sightings of the object asked for by place,
    float64 (Q, F); `age_rate` says at which rate a sighting of a companion loses its weight, per
    step, (Q,), and `likeness` how much each label is like that of the object, 0 to 1, (Q, L).

    Returns:
        Sightings of objects of the same name, (Q, F); companions that were seen last at a place,
        weighted by likeness and by how fresh that is, (Q, F); share of the sightings of companions
        by place, weighted by likeness, (Q, F); share of the sightings of all other objects by
        place, weighted by how much their names are alike, (Q, F); the greatest of these
        weights, (Q,); and other objects that were seen last where they are not usually, weighted
        by how lately that was, (Q, F).
    """
    num_queries, num_places = seen.shape
    same = np.zeros((num_queries, num_places))
    fresh = np.zeros((num_queries, num_places))
    often = np.zeros((num_queries, num_places))
    similar = np.zeros((num_queries, num_places))
    most = np.zeros(num_queries)
    strays = np.zeros((num_queries, num_places))
    num_objects = len(object_label)
    total = np.zeros(num_objects)
    square = np.zeros(num_objects)
    product = np.zeros(num_objects)
    usual = np.zeros(num_objects)
    for query in range(num_queries):
        home, asked = query_home[query], query_object[query]
        own_square = 0.0
        for place in range(num_places):
            own_square += seen[query, place] ** 2
        begin, end = edge_start[home], edge_start[home + 1]
        for position in range(begin, end):
            row = edge_object[edge_order[position]]
            total[row] = square[row] = product[row] = usual[row] = 0.0
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            total[row] += count
            square[row] += count * count
            usual[row] = max(usual[row], count)
            product[row] += count * seen[query, place]
            if row != asked and object_label[row] == object_label[asked]:
                same[query, place] += count
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            if row == asked or count == 0:
                continue
            name = likeness[query, object_label[row]]
            similar[query, place] += name * count / total[row]
            most[query] = max(most[query], name)
            age = age_rate[query] * (now - object_last_time[row])
            is_last = place == object_last_place[row]
            if is_last and count < usual[row]:
                strays[query, place] += math.exp(-_LATELY * age)
            if own_square == 0:
                continue
            alike = product[row] / math.sqrt(square[row] * own_square)
            if alike > _ALIKE:
                often[query, place] += alike * count / total[row]
                if is_last:
                    fresh[query, place] += alike * math.exp(-age)
    return same, fresh, often, similar, most, strays

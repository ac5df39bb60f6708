"""How sure the last sightings of things were."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def find_confidence(
    query_object: np.ndarray,
    num_objects: int,
    last_place: np.ndarray,
    last_time: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_last_true: np.ndarray,
    edge_confidence: np.ndarray,
) -> np.ndarray:
    """Return the confidence of the last sighting of Q things, 1 where there is none, (Q,).

    Args:
        query_object: row of each thing, which may be asked for twice, int64 (Q,).
        num_objects: rows there are.
        last_place: column of objects, (O,).
        last_time: likewise.
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_last_true: likewise.
        edge_confidence: likewise.
    """
    is_asked = np.zeros(num_objects, dtype=np.bool_)
    found = np.zeros(num_objects)
    for thing in query_object:
        is_asked[thing] = True
    for edge in range(len(edge_object)):
        thing = edge_object[edge]
        if is_asked[thing] and edge_place[edge] == last_place[thing]:
            if edge_last_true[edge] == last_time[thing]:
                found[thing] = max(found[thing], edge_confidence[edge])
    confidence = np.ones(len(query_object))
    for query in range(len(query_object)):
        if found[query_object[query]] > 0:
            confidence[query] = found[query_object[query]]
    return confidence

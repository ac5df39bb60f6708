"""What the looks and sightings of a memory say about things that are asked for."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel

NOTHING_SAID = -2  # as a place


@kernel
def list_looks_before(
    rows: np.ndarray,
    now: int,
    look_times: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_last_true: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """List the steps since looks that did not show K objects, and where each was ever seen.

    Args:
        rows: of the objects, -1 for what was never seen, int64 (K,).
        now: the present time step.
        look_times: of the latest looks at each place for each object, or for all alike, -1 for
            none, (K or 1, F, L).
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_last_true: likewise.

    Returns:
        Steps, infinite where there was no look, or none since it was seen there, float64 (K, F, L);
        and which places it has an edge to, bool (K, F).
    """
    num_given, num_places, num_kept = look_times.shape
    steps_ago = np.full((len(rows), num_places, num_kept), np.inf)
    is_remembered = np.zeros((len(rows), num_places), dtype=np.bool_)
    last_true = np.empty(num_places, dtype=np.int64)
    for thing in range(len(rows)):
        last_true[:] = -1
        for edge in range(len(edge_object)):
            if edge_object[edge] == rows[thing]:
                place = edge_place[edge]
                last_true[place] = max(last_true[place], edge_last_true[edge])
                is_remembered[thing, place] = True
        for place in range(num_places):
            for kept in range(num_kept):
                time = look_times[thing if num_given > 1 else 0, place, kept]
                if time > last_true[place]:
                    steps_ago[thing, place, kept] = now - time
    return steps_ago, is_remembered


@kernel
def list_seen_now(
    rows: np.ndarray,
    said_place: np.ndarray,
    now: int,
    num_places: int,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_last_true: np.ndarray,
    edge_confidence: np.ndarray,
) -> np.ndarray:
    """Return the confidence with which K objects were seen at F places in this step.

    Args:
        rows: of the objects, -1 for what was never seen, int64 (K,).
        said_place: where each was said to be in this step, -1 for nowhere, so that sightings
            elsewhere are older; `NOTHING_SAID` where nothing was, int64 (K,).
        now: the present time step.
        num_places: F.
        edge_object: column of edges, (E,).
        edge_place: likewise.
        edge_last_true: likewise.
        edge_confidence: likewise.

    Returns:
        0 where it was not seen, float64 (K, F).
    """
    seen = np.zeros((len(rows), num_places))
    for edge in range(len(edge_object)):
        if edge_last_true[edge] != now:
            continue
        for thing in range(len(rows)):
            place = edge_place[edge]
            is_said = said_place[thing] == NOTHING_SAID or said_place[thing] == place
            if edge_object[edge] == rows[thing] and is_said:
                seen[thing, place] = max(seen[thing, place], edge_confidence[edge])
    return seen

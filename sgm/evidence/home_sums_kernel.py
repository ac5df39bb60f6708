"""Sums over all nodes and edges of homes."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel


@kernel
def sum_objects(
    num_homes: int,
    num_places: int,
    home: np.ndarray,
    kind: np.ndarray,
    num_observed: np.ndarray,
    last_place: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Sum up the objects of H homes with up to F places; see `sgm.evidence.home_sums`.

    Args:
        num_homes: H.
        num_places: F.
        home: column of objects, (O,).
        kind: likewise, the type.
        num_observed: likewise.
        last_place: likewise.

    Returns:
        num_seen, sightings, num_typed and num_known, int64 (H,) each, and popularity, float64
        (H, F).
    """
    num_seen = np.zeros(num_homes, dtype=np.int64)
    sightings = np.zeros(num_homes, dtype=np.int64)
    num_typed = np.zeros(num_homes, dtype=np.int64)
    num_known = np.zeros(num_homes, dtype=np.int64)
    popularity = np.zeros((num_homes, num_places))
    for row in range(len(home)):
        own = home[row]
        sightings[own] += num_observed[row]
        if num_observed[row] > 0:
            num_seen[own] += 1
            if kind[row] >= 0:
                num_typed[own] += 1
        if last_place[row] >= 0:
            num_known[own] += 1
            popularity[own, last_place[row]] += 1
    return num_seen, sightings, num_typed, num_known, popularity


@kernel
def sum_edges(
    num_places: np.ndarray,
    object_kind: np.ndarray,
    home: np.ndarray,
    object_row: np.ndarray,
    prior: np.ndarray,
    num_true: np.ndarray,
    num_changed: np.ndarray,
    is_true: np.ndarray,
    time_true: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Sum up the edges of H homes.

    Args:
        num_places: of each home, (H,).
        object_kind: column of objects, (O,).
        home: column of edges, (E,).
        object_row: likewise.
        prior: likewise.
        num_true: likewise.
        num_changed: likewise.
        is_true: likewise.
        time_true: likewise.

    Returns:
        num_edges, num_left, time_true and num_placed, int64 (H,) each, and lift, float64 (H,).
    """
    num_homes = len(num_places)
    num_edges = np.zeros(num_homes, dtype=np.int64)
    num_left = np.zeros(num_homes, dtype=np.int64)
    time = np.zeros(num_homes, dtype=np.int64)
    num_placed = np.zeros(num_homes, dtype=np.int64)
    lift = np.zeros(num_homes)
    for edge in range(len(home)):
        own = home[edge]
        num_edges[own] += 1
        # Edges become true and false in turn: half of their changes were of this kind.
        num_left[own] += (num_changed[edge] + (not is_true[edge])) // 2
        time[own] += time_true[edge]
        if num_true[edge] > 0 and object_kind[object_row[edge]] >= 0:
            num_placed[own] += 1
            lift[own] += math.log(prior[edge] * num_places[own] * 0.9 + 0.1)
    return num_edges, num_left, time, num_placed, lift

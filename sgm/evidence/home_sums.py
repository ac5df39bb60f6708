"""What is counted over all things and places of homes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sgm.kernel import kernel
from sgm.memory.memory_batch import MemoryBatch


class HomeSums(NamedTuple):
    """Sums over the objects and edges of H homes, whatever the time step.

    Attributes:
        num_seen: objects that were ever seen, (H,).
        sightings: of all objects, (H,).
        num_typed: objects that were seen and whose type the prior knows, (H,).
        num_known: objects that were last seen at furniture that there is, (H,).
        popularity: how many of them at each place, float64 (H, F).
        num_edges: edges, (H,).
        num_left: looks that found an object gone from where it had been seen, (H,).
        time_true: time steps for which objects were known to be where they are, (H,).
        num_placed: places at which an object of a known type was seen, (H,).
        lift: by how much the prior gives these more than an even guess does, nats in sum, (H,).
        arrivals: moves to each place, (H, F).
        num_crossing: moves that led to another room, (H,).
    """

    num_seen: np.ndarray
    sightings: np.ndarray
    num_typed: np.ndarray
    num_known: np.ndarray
    popularity: np.ndarray
    num_edges: np.ndarray
    num_left: np.ndarray
    time_true: np.ndarray
    num_placed: np.ndarray
    lift: np.ndarray
    arrivals: np.ndarray
    num_crossing: np.ndarray

    @classmethod
    def of(cls, memory: MemoryBatch) -> HomeSums:
        """Sum up what a memory holds; once, of a memory whose content does not change."""
        kept = memory.derived
        if kept is None:
            return cls._compute(memory)
        if cls not in kept:
            kept[cls] = cls._compute(memory)
        sums: HomeSums = kept[cls]
        return sums

    @classmethod
    def _compute(cls, memory: MemoryBatch) -> HomeSums:
        objects, edges, history = memory.objects, memory.edges, memory.history
        num_crossing = np.zeros(memory.num_homes, dtype=np.int64)
        if history.counts_moves:
            room = memory.furniture_room
            crosses = room[:, :, None] != room[:, None, :]
            num_crossing = (history.moves * crosses).sum(axis=(1, 2))
        of_objects = _sum_objects(
            memory.num_homes, memory.num_furniture, objects["home"], objects["type"],
            objects["num_observed"], objects["last_furniture"],
        )  # fmt: skip
        of_edges = _sum_edges(
            memory.home_num_furniture, objects["type"], edges["home"], edges["object"],
            edges["prior"], edges["num_true"], edges["num_changed"], edges["is_true"],
            edges["time_true"],
        )  # fmt: skip
        return cls(*(*of_objects, *of_edges, history.moves.sum(axis=1), num_crossing))


@kernel
def _sum_objects(
    num_homes: int,
    num_places: int,
    home: np.ndarray,
    kind: np.ndarray,
    num_observed: np.ndarray,
    last_place: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Return `num_seen` to `popularity` of columns of objects, (O,); `kind` is their type."""
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
def _sum_edges(
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
    """Return `num_edges` to `lift` of columns of edges, (E,), and one of objects, (O,).

    `num_places` is of each home, (H,).
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

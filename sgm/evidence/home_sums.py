"""What is counted over all things and places of homes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.evidence.home_sums_kernel import sum_edges, sum_objects
from sgm.memory.memory_batch import MemoryBatch


@dataclass(frozen=True, slots=True)
class HomeSums:
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
        of_objects = sum_objects(
            memory.num_homes, memory.num_furniture, objects["home"], objects["type"],
            objects["num_observed"], objects["last_furniture"],
        )  # fmt: skip
        of_edges = sum_edges(
            memory.home_num_furniture, objects["type"], edges["home"], edges["object"],
            edges["prior"], edges["num_true"], edges["num_changed"], edges["is_true"],
            edges["time_true"],
        )  # fmt: skip
        return cls(*(*of_objects, *of_edges, history.moves.sum(axis=1), num_crossing))

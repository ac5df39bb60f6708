"""What is counted over all things and places of homes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
        home, was_seen = objects["home"], objects["num_observed"] > 0
        is_typed, is_known = objects["type"] >= 0, objects["last_furniture"] >= 0
        shape = memory.num_homes, memory.num_furniture
        last_place = (
            home[is_known].astype(np.int64) * shape[1] + objects["last_furniture"][is_known]
        )
        popularity = np.bincount(last_place, minlength=shape[0] * shape[1]).reshape(shape)
        placed = (edges["num_true"] > 0) & is_typed[edges["object"]]
        # Edges become true and false in turn: half of their changes were of this kind.
        num_left = (edges["num_changed"] + ~edges["is_true"]) // 2

        def count(homes: np.ndarray, number: np.ndarray | None = None) -> np.ndarray:
            """Sum whole numbers by home, (n,), (n,) -> (H,)."""
            return np.bincount(homes, number, minlength=shape[0]).astype(np.int64)

        return cls(
            num_seen=count(home[was_seen]),
            sightings=count(home, objects["num_observed"]),
            num_typed=count(home[was_seen & is_typed]),
            num_known=count(home[is_known]),
            popularity=popularity.astype(float),
            num_edges=count(edges["home"]),
            num_left=count(edges["home"], num_left),
            time_true=count(edges["home"], edges["time_true"]),
            num_placed=count(edges["home"][placed]),
            lift=_sum_lift(memory, np.flatnonzero(placed)),
            arrivals=history.moves.sum(axis=1),
            num_crossing=_count_crossing(memory),
        )


def _sum_lift(memory: MemoryBatch, placed: np.ndarray) -> np.ndarray:
    """Return `HomeSums.lift`; `placed` are the edges that count, (k,)."""
    home = memory.edges["home"][placed]
    even = memory.edges["prior"][placed].astype(float) * memory.home_num_furniture[home]
    return np.bincount(home, np.log(even * 0.9 + 0.1), minlength=memory.num_homes)


def _count_crossing(memory: MemoryBatch) -> np.ndarray:
    """Return `HomeSums.num_crossing`."""
    if not memory.history.counts_moves:
        return np.zeros(memory.num_homes, dtype=np.int64)
    room = memory.furniture_room
    crosses = room[:, :, None] != room[:, None, :]
    num_crossing: np.ndarray = (memory.history.moves * crosses).sum(axis=(1, 2))
    return num_crossing

"""Where things were ever seen, as arrays: what lists of them are cut from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.seen_positions import Told, tell_positions
from sgm.memory.sighting import RELATIONS, SeenAt


@dataclass(frozen=True, slots=True)
class SeenRows:
    """Each place where each thing was ever seen, n of them.

    Where the last place of a thing was removed, it is once more there, without a place.

    Attributes:
        edge: row of the edge, -1 for a place that was removed, (n,).
        thing: row of the thing, (n,).
        furniture: position of the place, -1 for one that was removed, (n,).
        relation: 0 "in", 1 "onTop", (n,).
        is_there: whether the last look showed it, bool (n,).
        time: time step of the last sighting, (n,).
        times_seen, times_looked: looks that showed it there, and looks, (n,).
    """

    edge: np.ndarray
    thing: np.ndarray
    furniture: np.ndarray
    relation: np.ndarray
    is_there: np.ndarray
    time: np.ndarray
    times_seen: np.ndarray
    times_looked: np.ndarray

    @classmethod
    def of_things(cls, memory: MemoryBatch, things: np.ndarray | None = None) -> SeenRows:
        """List those of some things by row, of all for None; what was merged is one already."""
        edges, objects = memory.edges, memory.objects
        is_asked = objects["same_as"] < 0  # others stand under another name
        if things is not None:
            is_asked &= np.isin(np.arange(objects.num_rows), things)
        seen = np.flatnonzero((edges["num_true"] > 0) & is_asked[edges["object"]])
        last = np.full(objects.num_rows, NEVER)
        np.maximum.at(last, edges["object"][seen], edges["last_true"][seen])
        return cls.of_edges(
            memory, seen, np.flatnonzero(is_asked & (objects["last_observed"] > last))
        )

    @classmethod
    def of_edges(cls, memory: MemoryBatch, seen: np.ndarray, left: np.ndarray) -> SeenRows:
        """List those of edges that were ever true (n,), and things whose last place was removed."""
        names = ("object", "furniture", "relation", "is_true", "last_true", "num_true")
        columns = [memory.edges[name][seen] for name in (*names, "num_observed")]
        if len(left):
            none = np.zeros(len(left), dtype=np.int64)
            last = memory.objects["last_observed"][left]
            of_left = (left, none - 1, none, none > 0, last, none, none)
            columns = [np.append(*pair) for pair in zip(columns, of_left, strict=True)]
            seen = np.append(seen, none - 1)
        return cls(seen, *columns)

    def take(self, rows: np.ndarray) -> SeenRows:
        """Return some of the rows, by index or mark."""
        return SeenRows(*(getattr(self, name)[rows] for name in SeenRows.__slots__))

    def find_current(self, name_of: np.ndarray) -> np.ndarray:
        """Find of each name where it is, or if it is nowhere, where it was seen last, ascending.

        `name_of` numbers the names of all things, (O,).
        """
        name = name_of[self.thing]
        is_placed = np.zeros(len(name_of), dtype=bool)
        is_placed[name[self.is_there]] = True
        order = np.lexsort((np.arange(len(name)), -self.time))
        order = order[~is_placed[name[order]]]
        latest = order[np.unique(name[order], return_index=True)[1]]
        return np.sort(np.append(np.flatnonzero(self.is_there), latest))

    def choose_latest(self, most: int) -> np.ndarray:
        """Return the `most` rows that were seen last, and all of the same time as the last one."""
        if len(self.time) <= most:
            return np.arange(len(self.time))
        least = -np.partition(-self.time, most - 1)[most - 1]
        return np.flatnonzero(self.time >= least)

    def tell(self, memory: MemoryBatch, furniture_ids: Sequence[int]) -> list[SeenAt]:
        """Return what each row says, with positions in the map where they are known."""
        told: list[Told] = [(None, None, None)] * len(self.time)
        has_edge = np.flatnonzero(self.edge >= 0)
        for row, at in zip(
            has_edge.tolist(), tell_positions(memory, self.edge[has_edge]), strict=True
        ):
            told[row] = at
        columns = (getattr(self, name).tolist() for name in SeenRows.__slots__[2:])
        return [
            SeenAt(
                time=time,
                steps_ago=memory.time - time,
                furniture=None if at < 0 else furniture_ids[at],
                relation=None if at < 0 else RELATIONS[relation],
                is_there=is_there,
                times_seen=times_seen,
                times_looked=times_looked,
                position=position,
                position_sd=position_sd,
                usual_position=usual,
            )
            for at, relation, is_there, time, times_seen, times_looked, (
                position,
                position_sd,
                usual,
            ) in zip(*columns, told, strict=True)
        ]

"""Where things were ever seen, as arrays: what lists of them are cut from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch


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
    def list(cls, memory: MemoryBatch, things: np.ndarray | None = None) -> SeenRows:
        """List those of some things by row, of all for None; what was merged is one already."""
        edges, objects = memory.edges, memory.objects
        is_asked = objects["same_as"] < 0  # others stand under another name
        if things is not None:
            is_asked &= np.isin(np.arange(len(objects)), things)
        seen = np.flatnonzero((edges["num_true"] > 0) & is_asked[edges["object"]])
        last = np.full(len(objects), NEVER)
        np.maximum.at(last, edges["object"][seen], edges["last_true"][seen])
        left = np.flatnonzero(is_asked & (objects["last_observed"] > last))
        none = np.zeros(len(left), dtype=np.int64)
        return cls(
            edge=np.append(seen, none - 1),
            thing=np.append(edges["object"][seen], left),
            furniture=np.append(edges["furniture"][seen], none - 1),
            relation=np.append(edges["relation"][seen], none),
            is_there=np.append(edges["is_true"][seen], none > 0),
            time=np.append(edges["last_true"][seen], objects["last_observed"][left]),
            times_seen=np.append(edges["num_true"][seen], none),
            times_looked=np.append(edges["num_observed"][seen], none),
        )

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

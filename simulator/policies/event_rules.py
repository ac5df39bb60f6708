"""Rules of temporal graph learning that nothing is trained for: EdgeBank, PopTrack, Base3.

They read sightings alone, as an event model of positive edges does; that a thing was not seen where
a look was, says nothing to them. Sources are things and destinations are places. Such rules rank
few places, and leave many tied.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sgm.arrays.grouped import max_relations, sum_relations
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, mask_furniture, spread_over_furniture
from sgm.schema import NEVER, NUM_RELATIONS

_FAR = np.iinfo(np.int32).max  # steps since what never happened


class EdgeBank(Policy):
    """Every place where the thing was ever seen, all alike.

    Source: Poursafaei et al. 2022, "Towards Better Evaluation for Dynamic Link Prediction".

    Attributes:
        window: sightings count for so many time steps; None for ever.
    """

    window: ClassVar[int | None] = None

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return 1 where the thing was seen within the window, else 0, (Q, F)."""
        age = find_ages(memory, queries)
        most = _FAR - 1 if self.window is None else self.window
        return mask_furniture(memory, queries, (age <= most).astype(float))


class EdgeBankWindow(EdgeBank):
    """Every place where the thing was seen in the last time steps, all alike.

    Source: as `EdgeBank`. Differs: the window is a number of steps, not the length of the test set,
    which a robot does not know.
    """

    window: ClassVar[int | None] = 25  # a quarter of a test home's life of 100


class PopTrack(Policy):
    """The places where most was seen of late, whatever is asked for.

    A sighting adds one to its place; every time step multiplies all by `decay`.

    Source: Daniluk and Dabrowski 2023, "Temporal Graph Models Fail to Capture Global Temporal
    Dynamics". Differs: time steps decay, not batches of events.
    """

    decay: ClassVar[float] = 0.95

    def reset(self, memory: MemoryBatch) -> None:
        """Start with nothing seen."""
        self._popularity = np.zeros(memory.is_furniture.shape)  # (H, F)
        self._time = memory.time

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Count what the look has shown."""
        self._popularity *= self.decay ** (memory.time - self._time)
        self._time = memory.time
        rows = change.edges[change.is_seen]
        place = (memory.edges["home"][rows], memory.edges["furniture"][rows])
        np.add.at(self._popularity, place, 1.0)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the popularity of each place, (Q, F)."""
        decayed = self._popularity * self.decay ** (memory.time - self._time)
        return mask_furniture(memory, queries, decayed[queries.home])


class Base3(PopTrack):
    """EdgeBank, PopTrack and co-occurrence in time (t-CoMem), a third each.

    t-CoMem of thing and place: exp(-age / window) x sigmoid(popularity) of the sighting there, if
    it is within the window, and `co_occurrence` x n / (1 + n) after n sightings there.

    Source: Kondrup 2025, "Base3: a simple interpolation-based ensemble method for robust dynamic
    link prediction". Differs: the sum over recent neighbours is of the candidate alone, since it is
    the same for all candidates otherwise; popularity is a share of the home's highest.
    """

    window: ClassVar[int] = 25
    co_occurrence: ClassVar[float] = 0.8

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the mean of the three, (Q, F)."""
        popularity = self._popularity * self.decay ** (memory.time - self._time)  # (H, F)
        highest = popularity.max(axis=1, keepdims=True, initial=0.0)
        share = np.divide(popularity, highest, out=np.zeros_like(popularity), where=highest > 0)
        age = find_ages(memory, queries)
        none = np.zeros((*age.shape, NUM_RELATIONS))
        num_true = memory.edges["num_true"]
        count = sum_relations(spread_over_furniture(memory, queries, num_true.__getitem__, none))
        recent = np.where(age <= self.window, np.exp(-np.minimum(age, _FAR) / self.window), 0.0)
        recent = recent / (1 + np.exp(-popularity[queries.home]))
        together = recent + self.co_occurrence * count / (1 + count)
        known = (age < _FAR).astype(float)
        return mask_furniture(memory, queries, (known + share[queries.home] + together) / 3)


def find_ages(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return the time steps since the thing was last seen at each place, int64 (Q, F).

    Where it never was, they are more than any time.
    """
    never = np.full((len(queries.home), memory.num_furniture, NUM_RELATIONS), NEVER)
    last_true = memory.edges["last_true"]
    last = max_relations(spread_over_furniture(memory, queries, last_true.__getitem__, never))
    return np.where(last == NEVER, _FAR, memory.time - last.astype(np.int64))

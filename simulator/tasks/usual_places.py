"""Where things have been most of the time: the truth that an answer is held against."""

from __future__ import annotations

import numpy as np

from simulator.world.homes import NUM_RELATIONS, Homes


class UsualPlaces:
    """Counts, time step by time step, where the objects of H homes are.

    The usual place of a description is the furniture node where its objects have been in most of
    the steps so far; several nodes may have been so equally often. It is the same for every policy.
    """

    def __init__(self, homes: Homes) -> None:
        """Count the places at t = 0."""
        self._homes = homes
        self._code = homes.object_code.copy()
        # Few objects move in a step: a stay is counted when it ends.
        self._place = np.full(self._code.shape, -1)
        self._since = np.zeros(self._code.shape, dtype=np.int32)
        self._counts = np.zeros((*self._code.shape, homes.num_furniture), dtype=np.int32)
        self._num_counted = 0
        self.count()

    def count(self) -> None:
        """Count where all objects are now."""
        self._end_stays()
        self._num_counted += 1

    def compute_out_of_place(
        self, home: np.ndarray, codes: np.ndarray, answers: np.ndarray
    ) -> np.ndarray:
        """Mark the queries whose object is at no usual place of its description, bool (Q,).

        Args:
            home: of each query, (Q,).
            codes: description codes, (Q,).
            answers: furniture that truly holds such an object, bool (Q, F).
        """
        self._end_stays()
        is_asked = self._code[home] == codes[:, None]
        query, slot = np.divmod(np.flatnonzero(is_asked), is_asked.shape[1])
        asked = (home[query], slot)
        counts = np.zeros(answers.shape, dtype=np.int64)
        np.add.at(counts, query, self._counts[asked])
        place = self._place[asked]
        here = np.flatnonzero(place >= 0)
        stay = self._num_counted - self._since[asked][here]
        np.add.at(counts, (query[here], place[here] // NUM_RELATIONS), stay)
        most = counts.max(axis=1, keepdims=True)
        is_usual = (answers & (counts == most)).any(axis=1)
        return (most[:, 0] > 0) & ~is_usual

    def _end_stays(self) -> None:
        """Count the stays of what is elsewhere now, and forget what was replaced."""
        place = np.where(self._homes.is_present, self._homes.object_place, -1)
        is_other = self._homes.object_code != self._code
        moved = np.flatnonzero((place != self._place) | is_other)
        if len(moved) == 0:
            return
        at = np.divmod(moved, place.shape[1])
        before = self._place[at]
        stay = (self._num_counted - self._since[at]) * (before >= 0)
        self._counts[(*at, np.maximum(before, 0) // NUM_RELATIONS)] += stay
        self._since[at] = self._num_counted
        self._place[at] = place[at]
        replaced = np.divmod(np.flatnonzero(is_other), place.shape[1])
        self._counts[replaced] = 0
        self._code[replaced] = self._homes.object_code[replaced]

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
        shape = (homes.num_homes, homes.num_slots, homes.num_furniture)
        self._counts = np.zeros(shape, dtype=np.int32)
        self.count()

    def count(self) -> None:
        """Count where all objects are now."""
        self._forget_replaced()
        home, slot = np.nonzero(self._homes.is_present)
        place = self._homes.object_place[home, slot]
        self._counts[home, slot, place // NUM_RELATIONS] += 1

    def compute_out_of_place(
        self, home: np.ndarray, codes: np.ndarray, answers: np.ndarray
    ) -> np.ndarray:
        """Mark the queries whose object is at no usual place of its description, bool (Q,).

        Args:
            home: of each query, (Q,).
            codes: description codes, (Q,).
            answers: furniture that truly holds such an object, bool (Q, F).
        """
        self._forget_replaced()
        query, slot = np.nonzero(self._code[home] == codes[:, None])
        counts = np.zeros(answers.shape, dtype=np.int64)
        np.add.at(counts, query, self._counts[home[query], slot])
        most = counts.max(axis=1, keepdims=True)
        is_usual = (answers & (counts == most)).any(axis=1)
        return (most[:, 0] > 0) & ~is_usual

    def _forget_replaced(self) -> None:
        """Forget what was counted of objects whose slots hold others now."""
        is_other = self._homes.object_code != self._code
        self._counts[is_other] = 0
        self._code[is_other] = self._homes.object_code[is_other]

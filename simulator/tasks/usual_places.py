"""Where things have been most of the time: the truth that an answer is held against."""

from __future__ import annotations

import numpy as np

from simulator.tasks.usual_place_kernel import end_stays, mark_out_of_place
from simulator.world.homes import Homes


class UsualPlaces:
    """Counts, time step by time step, where the objects of H homes are.

    The usual place of a description is the furniture node where its objects have been in most of
    the steps so far; several nodes may have been so equally often. It is the same for every policy.
    """

    def __init__(self, homes: Homes) -> None:
        """Count the places at t = 0."""
        self._homes = homes
        code = homes.object_code.copy()
        # Few objects move in a step: a stay is counted when it ends.
        self._stays = (
            code,
            np.full(code.shape, -1),
            np.zeros(code.shape, dtype=np.int32),
            np.zeros((*code.shape, homes.num_furniture), dtype=np.int32),
        )
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
        return mark_out_of_place(home, codes, answers, self._num_counted, *self._stays)

    def _end_stays(self) -> None:
        homes = self._homes
        end_stays(homes.object_place, homes.object_code, self._num_counted, *self._stays)

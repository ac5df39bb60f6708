"""Where things have been most of the time: the truth that an answer is held against."""

from __future__ import annotations

import numpy as np

from sgm.schema import NUM_RELATIONS
from simulator.kernel import kernel
from simulator.world.homes import Homes

# Description of the object that a slot held, where it was, -1 for nowhere, `num_counted` when it
# came there, (H, C) each, and steps of ended stays, (H, C, F).
Stays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


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
        """Mark the queries (Q,) whose object is at no usual place; `answers` are the true ones."""
        self._end_stays()
        return mark_out_of_place(home, codes, answers, self._num_counted, self._stays)

    def _end_stays(self) -> None:
        homes = self._homes
        end_stays(homes.object_place, homes.object_code, self._num_counted, self._stays)


@kernel
def end_stays(
    object_place: np.ndarray, object_code: np.ndarray, num_counted: int, stays: Stays
) -> None:
    """Count the stays of what is elsewhere now, and forget what was replaced, in place."""
    code, furniture, since, counts = stays
    for home in range(len(code)):
        for slot in range(code.shape[1]):
            current = object_place[home, slot] // NUM_RELATIONS  # -1 of -1
            before = furniture[home, slot]
            is_other = object_code[home, slot] != code[home, slot]
            if current == before and not is_other:
                continue
            if is_other:
                counts[home, slot] = 0
                code[home, slot] = object_code[home, slot]
            elif before >= 0:
                counts[home, slot, before] += num_counted - since[home, slot]
            furniture[home, slot] = current
            since[home, slot] = num_counted


@kernel
def mark_out_of_place(
    query_home: np.ndarray,
    query_code: np.ndarray,
    answers: np.ndarray,
    num_counted: int,
    stays: Stays,
) -> np.ndarray:
    """Mark the queries whose object is at no usual place of its description, bool (Q,)."""
    code, furniture, since, counts = stays
    num_furniture = answers.shape[1]
    is_out = np.zeros(len(query_home), dtype=np.bool_)
    total = np.empty(num_furniture, dtype=np.int64)
    for query in range(len(query_home)):
        home, asked = query_home[query], query_code[query]
        total[:] = 0
        for slot in range(code.shape[1]):
            if code[home, slot] != asked:
                continue
            for place in range(num_furniture):
                total[place] += counts[home, slot, place]
            current = furniture[home, slot]
            if current >= 0:
                total[current] += num_counted - since[home, slot]
        most = most_answered = 0
        for place in range(num_furniture):
            most = max(most, total[place])
            if answers[query, place]:
                most_answered = max(most_answered, total[place])
        is_out[query] = most > most_answered
    return is_out

"""Questions of people: they ask for what they have and need, whether it is in the home or not."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from sgm.arrays.grouped import compute_starts
from sgm.policies.policy import Policy
from simulator.tasks.predict_location import PredictLocation, answer_queries
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.rollout import sample_query
from simulator.world.homes import Homes

_LATELY = 5  # steps at which the robot looks, after which what was moved is in use no longer
_TRIES = 8  # to find a thing that a home has never had among all that there may be
_SCALE = 1000  # of `move_freq`, for whole weights


class AskAnything(PredictLocation):
    """Predict Object Location, where anything is asked for that the robot has seen or people have.

    What is asked for may be out for the day, have left for good, or never have been there: then no
    furniture is right. What has just moved is asked for no more than other things, but for the
    share of questions that are the paper's; these are marked (`Answer.asks_moved`).

    A home scores 1 if the chosen furniture holds the object. The task is in no table, and not in
    the paper: networks learn from it (`data.task`, `data.asked`).
    """

    title = "Predict Object Location, anything"
    asks_moved: ClassVar[float] = 0.0
    shares = QuestionShares()

    def __init__(self, homes: Homes, policy: Policy) -> None:
        """Start at t = 0 with an empty memory."""
        super().__init__(homes, policy)
        self._was_there = homes.is_present.copy()  # slots, (H, C)
        self._place = homes.object_place.copy()  # at the step before, (H, C)
        self._times: deque[int] = deque(maxlen=_LATELY + 1)  # of the latest steps
        self._since_moved = np.full(self._place.shape, _LATELY)  # steps, (H, C)

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each tells whether the homes' answers were right, 0 or 1 (H,)."""
        rollout = self.rollout
        for _ in range(num_steps):
            rollout.evolve()
            self._note_moves()
            codes, is_task = self.draw_codes()
            queries = rollout.query(np.arange(len(codes)), codes)
            answer = answer_queries(rollout, codes, queries, is_task)
            self.on_answer(answer)
            yield answer.is_correct.astype(float)
            rollout.look_around(answer.choice)

    def draw_codes(self) -> tuple[np.ndarray, np.ndarray]:
        """Draw what is asked for in this step: description codes, and which are the paper's, (H,).

        Every home takes as many random numbers, whatever is asked in it.
        """
        homes, shares = self.rollout.homes, self.shares
        everyone = np.arange(homes.num_homes)
        self._was_there |= homes.is_present
        uniform = homes.streams.rows("query anything", 2 + 2 * _TRIES).take()
        kind_uniform, object_uniform = uniform[:, 0], uniform[:, 1]
        home, code = self._list_known()
        owner, slot = np.nonzero(self._was_there)
        needs = 1 + np.rint(_SCALE * homes.move_freq[homes.object_type[owner, slot]])
        is_used = self._is_among(homes.is_present & (self._since_moved < _LATELY), home, code)
        is_found = self._was_found(home, code)
        owned, absent, seen, used, found = (
            _draw_of_homes(own_home, codes, weight, object_uniform, homes.num_homes)
            for own_home, codes, weight in (
                (owner, homes.object_code[owner, slot], needs),
                (home, code, ~self._is_among(homes.is_present, home, code)),
                (home, code, np.ones(len(home))),
                (home, code, is_used),
                (home, code, is_found),
            )
        )
        unknown = self._draw_unknown(uniform[:, 2:], home, code)
        ends = shares.task + np.cumsum(
            [shares.unknown, shares.owned, shares.absent, shares.used, shares.found]
        )
        number = np.searchsorted(ends, kind_uniform, side="right")
        codes = np.stack([unknown, owned, absent, used, found, seen])[number, everyone]
        for other in (seen, owned):  # where there is nothing of what is asked for
            codes = np.where(codes < 0, other, codes)
        is_task = kind_uniform < shares.task
        of_task = homes.object_code[everyone, sample_query(homes)]
        return np.where(is_task, of_task, codes), is_task

    def _note_moves(self) -> None:
        """Note which things are elsewhere than at the step before, and when that was."""
        self._times.append(self.rollout.memory.time)
        place = self.rollout.homes.object_place
        self._since_moved = np.where(place != self._place, 0, self._since_moved + 1)
        self._place = place.copy()

    def _list_known(self) -> tuple[np.ndarray, np.ndarray]:
        """List what the robots have seen: homes, ascending, and description codes, (n,) each."""
        objects = self.rollout.memory.objects
        rows = np.flatnonzero(objects["num_observed"] > 0)
        rows = rows[np.argsort(objects["home"][rows], kind="stable")]
        return objects["home"][rows], objects["key"][rows]

    def _was_found(self, home: np.ndarray, code: np.ndarray) -> np.ndarray:
        """Tell whether the robot has found such a thing moved lately, bool (n,)."""
        memory = self.rollout.memory
        rows = memory.find_objects(home, code)
        found: np.ndarray = memory.objects["last_moved"][rows] >= self._times[0]
        return found

    def _is_among(self, slots: np.ndarray, home: np.ndarray, code: np.ndarray) -> np.ndarray:
        """Tell whether such an object is in one of its home's slots (H, C), bool (n,)."""
        homes = self.rollout.homes
        width = homes.object_descriptions.num_descriptions
        slot_home, slot = np.nonzero(slots)
        among = np.zeros(homes.num_homes * width, dtype=bool)
        among[slot_home * width + homes.object_code[slot_home, slot]] = True
        found: np.ndarray = among[home * width + code]
        return found

    def _draw_unknown(
        self, uniform: np.ndarray, known_home: np.ndarray, known_code: np.ndarray
    ) -> np.ndarray:
        """Draw a description that each home has never had, (H,); -1 where none was found."""
        homes = self.rollout.homes
        table, num_types = homes.object_descriptions, len(homes.object_labels)
        had = np.zeros((homes.num_homes, table.num_descriptions), dtype=bool)
        had[np.nonzero(self._was_there)[0], homes.object_code[self._was_there]] = True
        had[known_home, known_code] = True
        count = np.bincount(table.type_of_code, minlength=num_types)
        first = compute_starts(count)
        types = (uniform[:, ::2] * num_types).astype(int)  # (H, tries)
        codes = first[types] + (uniform[:, 1::2] * count[types]).astype(int)
        codes = np.minimum(codes, table.num_descriptions - 1)
        is_new = (count[types] > 0) & ~np.take_along_axis(had, codes, axis=1)
        everyone = np.arange(homes.num_homes)
        chosen = is_new.argmax(axis=1)
        return np.where(is_new[everyone, chosen], codes[everyone, chosen], -1)


def _draw_of_homes(
    home: np.ndarray, code: np.ndarray, weight: np.ndarray, uniform: np.ndarray, num_homes: int
) -> np.ndarray:
    """Draw one of the codes (n,) of each home by whole weights (n,) and numbers (H,).

    Homes ascend, (n,). Whole weights have exact sums, so that a home does not depend on others.

    Returns:
        The codes, (H,); -1 where a home has none of a positive weight.
    """
    ends = np.cumsum(weight, dtype=np.int64)
    bounds = np.append(0, ends)[compute_starts(np.bincount(home, minlength=num_homes))]
    low, total = bounds[:-1], np.diff(bounds)
    known = np.searchsorted(ends, low + (uniform * total).astype(np.int64), side="right")
    drawn = np.full(num_homes, -1, dtype=np.int64)
    drawn[total > 0] = code[known[total > 0]]
    return drawn

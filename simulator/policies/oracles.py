"""Oracles: the paper's, and one of homes with schedules that has lived in copies of the home."""

from __future__ import annotations

from collections import deque
from typing import ClassVar

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.arrays.week import DAY_SECONDS, HOUR_SECONDS, WEEK_SECONDS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.heuristics import LastSeenUnlessAbsent
from sgm.policies.policy import Policy, mask_furniture
from sgm.schema import NEVER, NUM_RELATIONS
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import TRUE_SCHEDULES, TRUE_TRANSITIONS

_DAYS = 210  # lived in a copy: 150 weekdays and 60 days of weekends
_HOURS_KEPT = 48  # of looks that a day of the copy is compared with
_DOUBT = 0.02  # of what a copy says: its people drift otherwise than those of the home
_STAYS = 0.1  # how much the last place counts beside the copies, where no look has contradicted
_SATURDAY = 5  # days are numbered from Monday, 0


class Oracle(LastSeenUnlessAbsent):
    """Where it was seen last unless absent, else by the home's true dynamics T.

    Source: paper section 5.3: "ground truth knowledge about the dynamics" and a "memory of past
    observed object locations"; docs/design.md, ruling 20. `Ceiling` is how good an answer can be.
    """

    needs: ClassVar[frozenset[str]] = frozenset((TRUE_TRANSITIONS,))

    def __init__(self, homes: Homes) -> None:
        """Keep the true homes."""
        self._homes = homes

    @classmethod
    def make(cls, homes: Homes) -> Oracle:
        """Keep the true homes."""
        return cls(homes)

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the row of T, (Q, F)."""
        codes = memory.objects["key"][queries.object]
        rows = self._homes.transition_rows(queries.home, codes)
        return sum_relations(rows.reshape(len(rows), -1, NUM_RELATIONS)).astype(float)


class ScheduleOracle(Policy):
    """Where the object was on days like this in copies of the home.

    A copy starts from the true home at step 0, with its residents, their habits and the usual
    places of all things, and lives on with random numbers of its own (`Life.sample_hours`). Every
    day of it at the present hour, weekdays on weekdays and weekends at weekends, is a sample of
    what may have happened in the home since two days ago. It is weighted by how likely the looks of
    that time would have seen what they saw, given the true miss rate, and by how likely the object
    would have been asked for (docs/design.md, ruling 9). The score of a place is the weighted share
    of the samples in which it holds such an object, and a little more where it was seen last.

    It is a strong reference and no bound: samples are few, hours are whole, and a usual place
    that is new in the home is in none of the copies.
    """

    needs: ClassVar[frozenset[str]] = frozenset((TRUE_SCHEDULES,))

    def __init__(self, homes: SampledHomes) -> None:
        """Keep the true homes."""
        assert homes.clock is not None  # who has schedules has a clock
        self._homes = homes
        self._clock = homes.clock
        self._lives: np.ndarray | None = None

    @classmethod
    def make(cls, homes: Homes) -> ScheduleOracle:
        """Keep the true homes."""
        assert isinstance(homes, SampledHomes)  # no others have schedules
        return cls(homes)

    def reset(self, memory: MemoryBatch) -> None:
        """Live in the copies, unless that is done, and forget all looks."""
        if self._lives is None:
            self._lives = self._homes.sample_hours(24 * _DAYS)
        self._looks: list[deque[tuple[int, int, float, np.ndarray]]] = [
            deque() for _ in range(memory.num_homes)
        ]

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Note one look per home: when, where, how much was in view, and what was seen."""
        rows = memory.edges["object"][change.edges[change.is_seen]]
        homes = memory.objects["home"][rows]
        for home, furniture, coverage in zip(
            change.home, change.furniture, change.coverage, strict=True
        ):
            looks = self._looks[home]
            looks.append((memory.time, furniture, coverage, rows[homes == home]))
            oldest = memory.time - _HOURS_KEPT * HOUR_SECONDS / self._clock[home, 1]
            while looks[0][0] < oldest:
                looks.popleft()

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the probability that each furniture node holds such an object, (Q, F)."""
        scores = np.zeros((len(queries.home), memory.num_furniture))
        for query, (home, thing) in enumerate(zip(queries.home, queries.object, strict=True)):
            code = memory.objects["key"][thing]
            slots = np.flatnonzero(self._homes.object_code[home] == code)
            weight, place = self._weigh_days(memory.time, home, thing, slots)
            for slot in range(len(slots)):
                is_new = (place[:, slot, None] != place[:, :slot]).all(axis=1) & (
                    place[:, slot] >= 0
                )
                np.add.at(scores[query], place[is_new, slot], weight[is_new])
            last = memory.objects["last_furniture"][thing]
            if last != NEVER:
                since = memory.objects["last_observed"][thing]
                looked = [n for t, f, _, _ in self._looks[home] for n in [t > since] if f == last]
                scores[query, last] += _STAYS * (not any(looked))
        return mask_furniture(memory, queries, scores)

    def _weigh_days(
        self, time: int, home: int, thing: int, slots: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the weights (W,) of days of the copy, and the places of some objects then (W, k).

        The object has a row in the memory, those that are called so are in slots (k,).
        """
        assert self._lives is not None
        lives = self._lives[home]  # (hours, C)
        start, step = self._clock[home]
        now = find_hours_alike(start, time * step, len(lives))
        now = now[now >= _HOURS_KEPT]
        lived = lives[:, slots]
        weight = np.ones(len(now))
        looks = self._looks[home]
        if looks:
            ago = np.array([round((time - then) * step / HOUR_SECONDS) for then, *_ in looks])
            furniture = np.array([place for _, place, *_ in looks])
            in_view = np.array([share for *_, share, _ in looks])
            is_seen = np.array([thing in seen for *_, seen in looks])
            then = lived[now[:, None] - ago]  # (W, looks, k)
            count = (then == furniture[:, None]).sum(axis=2)
            miss = 1 - in_view * (1 - self._homes.detection_error[home])
            unseen = miss**count
            likely = _DOUBT + (1 - 2 * _DOUBT) * np.where(is_seen, 1 - unseen, unseen)
            weight = np.exp(np.log(likely).sum(axis=1))
        hours = max(round(step / HOUR_SECONDS), 1)
        share = min(step / HOUR_SECONDS, 1.0)  # of the moves of an hour, those of a step
        has_moved = (lives[now] != lives[now - hours]) & (lives[now] >= 0)
        num_moved = np.maximum(has_moved.sum(axis=1) * share, 1)
        asked_moved = has_moved[:, slots].sum(axis=1) * share / num_moved
        asked_any = 1 / np.maximum((lives[now] >= 0).sum(axis=1), 1)
        weight *= 0.5 * asked_moved + 0.5 * asked_any
        return weight / weight.sum(), lived[now]


def find_hours_alike(start: float, seconds: float, num_hours: int) -> np.ndarray:
    """Return the hours of a life that are at the same time of the same kind of day, (W,).

    The life starts `start` seconds after Monday 00:00; the time is `seconds` after that.
    """
    hour = np.arange(num_hours)
    at_the_time = hour % 24 == round(seconds / HOUR_SECONDS) % 24

    def is_weekend(since: np.ndarray) -> np.ndarray:
        return np.mod(start + since, WEEK_SECONDS) // DAY_SECONDS >= _SATURDAY

    same_kind = is_weekend(hour * HOUR_SECONDS) == is_weekend(np.array([seconds]))
    return np.flatnonzero(at_the_time & same_kind)

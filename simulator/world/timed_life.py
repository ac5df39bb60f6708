"""Homes whose lives run by the clock, however long a time step is."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from sgm.memory.clock import Clock
from sgm.schema import PlaceCode
from simulator.world.dynamics import Life
from simulator.world.sampled_state import SampledState

HOUR = 3600.0


class TimedLife(Life):
    """Some homes of a group in which things happen at times, in seconds since a Monday, 00:00.

    A subclass makes `state`, a named tuple of arrays whose `place` is `object_place` of the homes
    and whose `random` holds a generator for each home, lives up to the first step, and calls
    `note_start` then.

    Attributes:
        state: what changes in the homes.
    """

    state: Any

    def __init__(
        self,
        homes: SampledState,
        members: np.ndarray,
        clocks: Sequence[Clock],
        outlook_days: Sequence[int],
        purpose: str,
    ) -> None:
        """Take charge of some homes of a group.

        Args:
            homes: the group.
            members: the homes, (n,).
            clocks: of each of them.
            outlook_days: for how long a copy of each is lived in to find where things are.
            purpose: with which names of random streams begin.
        """
        self._homes = homes
        self._members = members
        self._purpose = purpose
        self._outlook: np.ndarray | None = None
        self._outlook_hours = 24 * np.array(outlook_days)
        rows = np.array([clock.row for clock in clocks])
        self._start, self._step = np.ascontiguousarray(rows.T)  # as kernels take them
        self._num_steps = 0

    @abstractmethod
    def live(self, state: Any, members: np.ndarray, until: np.ndarray) -> None:
        """Let some of the homes (n,) live until times (n,): the state changes in place."""

    def note_start(self) -> None:
        """Take the present state for that of step 0."""
        self._at_start = copy_state(self.state)

    def step(self) -> None:
        """Let one time step pass."""
        homes = self._homes
        before = homes.object_place[self._members]
        self._num_steps += 1
        self.live(self.state, self._members, self._start + self._num_steps * self._step)
        after = homes.object_place[self._members]
        has_moved = PlaceCode.furniture(before) != PlaceCode.furniture(after)
        homes.object_moved[self._members] = has_moved & (after >= 0)
        homes.num_objects[self._members] = (after >= 0).sum(axis=1)

    def skip(self, num_steps: int) -> None:
        """Let time steps pass at once; `object_moved` does not say what has moved in them."""
        self._num_steps += num_steps
        self.live(self.state, self._members, self._start + self._num_steps * self._step)

    def count_hours(self) -> np.ndarray:
        """Count at how many hours of the outlook objects are at each place, float32 (H, C, P).

        They are lived in a copy of the homes as at step 0. Time out of the home does not count.
        """
        if self._outlook is None:
            state = self._start_copy(f"{self._purpose} outlook")
            num_place_codes = PlaceCode.count(self._homes.num_furniture)
            counts = np.zeros((*state.place.shape, num_place_codes), dtype=np.float32)
            for hour in range(1, self._outlook_hours.max() + 1):
                is_on = hour <= self._outlook_hours
                members = self._members[is_on]
                self.live(state, members, self._start[is_on] + HOUR * hour)
                member, slot = np.nonzero(state.place[members] >= 0)
                counts[members[member], slot, state.place[members[member], slot]] += 1
            self._outlook = counts
        return self._outlook

    def sample_hours(self, num_hours: int) -> np.ndarray:
        """Live on from step 0 with the same habits and other random numbers; see `Life`."""
        state = self._start_copy(f"{self._purpose} copy")
        num_homes, num_slots = state.place.shape
        lived = np.empty((num_homes, num_hours, num_slots), dtype=np.int16)
        for hour in range(num_hours):
            self.live(state, self._members, self._start + HOUR * hour)
            lived[:, hour] = PlaceCode.furniture(state.place)
        return lived

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the share of time that objects are at each place; see `count_hours`."""
        counts = self.count_hours()
        rows, slots = np.nonzero(self._homes.object_code[homes] == codes[:, None])
        found = np.zeros((len(homes), counts.shape[2]), dtype=np.float32)
        np.add.at(found, rows, counts[homes[rows], slots])
        total = found.sum(axis=1, keepdims=True)
        return np.divide(found, total, out=found, where=total > 0)

    def _start_copy(self, purpose: str) -> Any:
        """Return the state at step 0, with the random numbers of a purpose."""
        state = copy_state(self._at_start)
        for home in self._members:
            state.random[home] = draw_seed(self._homes.streams.generator(purpose, home))
        return state


def copy_state(state: Any) -> Any:
    """Return a named tuple of copies of its arrays."""
    return type(state)(*(array.copy() for array in state))


def draw_seed(rng: np.random.Generator) -> np.uint64:
    """Draw the state of a generator of kernels."""
    return rng.integers(0, 2**64, dtype=np.uint64)

"""The looks since things were last seen, in the order of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class LooksSince(NamedTuple):
    """The looks since Q things were last seen, aligned at their ends.

    Looks at one place in one time step are one look here.

    Attributes:
        when, where: time, that of the sighting or 0 before it, and place, (n, Q).
        number: of looks at that place in that step, (n, Q); 0 for what is no look.
    """

    when: np.ndarray
    where: np.ndarray
    number: np.ndarray

    @classmethod
    def list(
        cls,
        look_times: np.ndarray,
        look_row: np.ndarray,
        last_place: np.ndarray,
        last_time: np.ndarray,
    ) -> LooksSince:
        """List looks but for those that saw the thing; see `follow_looks`."""
        num_kept = look_times.shape[2]
        times, number = _join_equal(look_times)
        times, number = (each.reshape(len(look_times), -1).T for each in (times, number))
        order = times.argsort(axis=0, kind="stable")
        # From the end on, as many as any home has: what is no look has the time -1.
        order = order[len(times) - np.count_nonzero(times >= 0, axis=0).max(initial=0) :]
        home = np.arange(len(look_times))
        when, number = times[order, home][:, look_row], number[order, home][:, look_row]
        where = (order // num_kept)[:, look_row]
        start = np.where(last_place >= 0, last_time, -1)
        counts = (when >= np.maximum(start, 0)) & ((when > start) | (where != last_place))
        return cls(when=when, where=where, number=number)._choose(counts)

    def take(self, chosen: np.ndarray) -> LooksSince:
        """Leave the other looks out, bool (n, Q)."""
        return self if chosen.all() else self._choose(chosen)

    def _choose(self, chosen: np.ndarray) -> LooksSince:
        number = self.number * chosen
        used = number.any(axis=1)
        return LooksSince(when=self.when[used], where=self.where[used], number=number[used])

    def start(self, last_place: np.ndarray, last_time: np.ndarray, now: int) -> np.ndarray:
        """Return when each belief starts: at the last sighting, else at the first look, (Q,)."""
        first = np.where(self.number > 0, self.when, now).min(axis=0, initial=now)
        return np.where(last_place >= 0, last_time, first)

    def compute_detection(self, miss: np.ndarray) -> np.ndarray:
        """Return how likely each shows what is there, 0 for what is no look, (Q,) -> (n, Q)."""
        detection: np.ndarray = 1 - miss**self.number
        return detection

    def count_steps(self, start: np.ndarray, now: int) -> np.ndarray:
        """Return the time steps from the start until each look, and until now, (n + 1, Q).

        What is no look is at the time of the look before it.
        """
        time = np.full((len(self.when) + 1, len(start)), now)
        time[:-1] = np.where(self.number > 0, self.when, start)
        return np.maximum.accumulate(time, axis=0) - start


def _join_equal(look_times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times of looks of which equal ones at a place are one, and how many each is.

    Both (m, F, L), -1 and 1 for what is no look or another one.
    """
    times = np.sort(look_times, axis=2)
    is_next_equal = np.zeros(times.shape, dtype=bool)
    np.equal(times[..., 1:], times[..., :-1], out=is_next_equal[..., :-1])
    is_next_equal &= times >= 0
    number = np.ones(times.shape, dtype=np.int64)
    if is_next_equal.any():
        for kept in range(1, times.shape[2]):
            number[..., kept] += number[..., kept - 1] * is_next_equal[..., kept - 1]
        times = np.where(is_next_equal, -1, times)
    return times, number

"""At which of the latest moments a place was looked at, and which of them showed each thing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.arrays.table import clone
from sgm.arrays.week import HOUR_SECONDS
from sgm.schema import NEVER

# At one place: at least ten days of a robot that looks all day, months of one that looks twice.
NUM_MOMENTS = 256
MOMENT_SECONDS = HOUR_SECONDS / 2  # looks within one are one moment
COLUMNS = {  # in a memory file, and what each is
    "num_times": "half hours in which each furniture was looked at, the latest 256 at most",
    "times": "step of the last look in each, those of one furniture after the other",
    "num_runs": "entries of `runs` that each edge has; 0 if no look said anything of it",
    "runs": "half hours in a row that said the same, times 3; plus 1 if they missed it, 2 if seen",
}
MISSED, SHOWN = 1, 2  # what a moment said of an edge; 0 for nothing


class Moments:
    """The latest looks at each place of H homes with F furniture nodes and E edges, thinned.

    Looks within half an hour of the clock are one moment: it showed a thing if one of them did.
    Homes without a clock have none. What is kept does not grow with time.

    Attributes:
        times: time steps of the last look of each moment at each furniture node, in no order,
            `NEVER` for none, int32 (H, F, NUM_MOMENTS).
        states: what each of them said of an edge there, 0, `MISSED` or `SHOWN`, uint8
            (E', NUM_MOMENTS); rows of edges beyond E' are left out.
    """

    def __init__(self, num_homes: int, num_furniture: int) -> None:
        """Start without moments, which takes no memory."""
        self.times = _make_none(num_homes, num_furniture)
        self.states = np.zeros((0, NUM_MOMENTS), dtype=np.uint8)

    @property
    def is_counted(self) -> bool:
        """Whether there is any moment."""
        return self.times.flags.writeable

    def add_furniture(self, num_added: int) -> None:
        """Add columns of furniture that was never looked at."""
        num_homes, before, _ = self.times.shape
        if self.is_counted:
            wider = ((0, 0), (0, num_added), (0, 0))
            self.times = np.pad(self.times, wider, constant_values=NEVER)
        else:
            self.times = _make_none(num_homes, before + num_added)

    def copy(self) -> Moments:
        """Return the same moments, which can be changed alone."""
        copied = clone(self)
        if self.is_counted:
            copied.times = self.times.copy()
        copied.states = self.states.copy()
        return copied

    def take(self, furniture: np.ndarray, edges: np.ndarray) -> Moments:
        """Return a copy that keeps some furniture (F,) and edges (E,), bool."""
        kept = Moments(len(self.times), int(furniture.sum()))
        times = self.times[:, furniture]
        if self.is_counted and (times != NEVER).any():
            kept.times = times
        num_known = min(len(self.states), len(edges))  # beyond these are rows to spare
        kept.states = self.states[:num_known][edges[:num_known]]
        return kept

    def join(self, group: np.ndarray, num_groups: int) -> None:
        """Let edges of one place become one: a moment showed it if it showed any of them.

        `group` is the number of that which each edge becomes, (E,).
        """
        if self.is_counted:
            states = self.get_states(np.arange(len(group)))
            self.states = np.zeros((num_groups, NUM_MOMENTS), dtype=np.uint8)
            np.maximum.at(self.states, group, states)

    def merge_furniture(self, kept: int, gone: int, place: np.ndarray) -> None:
        """Let the moments at one furniture node of a home be those at two, by position.

        `place` is where each edge was, (E,).
        """
        if not self.is_counted:
            return
        times = np.concatenate([self.times[0, kept], self.times[0, gone]])
        latest = np.argsort(times, kind="stable")[-NUM_MOMENTS:]
        self.times[0, kept], self.times[0, gone] = times[latest], NEVER
        states = self.states = self.get_states(np.arange(len(place)))
        for number, at in enumerate((kept, gone)):
            rows = np.flatnonzero(place == at)
            wide = np.zeros((len(rows), 2, NUM_MOMENTS), dtype=np.uint8)
            wide[:, number] = states[rows]
            states[rows] = wide.reshape(len(rows), 2 * NUM_MOMENTS)[:, latest]

    def note_look(
        self,
        clock: np.ndarray,
        time: int,
        looked: tuple[np.ndarray, np.ndarray],
        edge_home: np.ndarray,
        edges_looked_at: np.ndarray,
        found: tuple[np.ndarray, np.ndarray],
    ) -> None:
        """Note a look in each of some homes, each once.

        Args:
            clock: of every home, (H, 2), nan where it is unknown.
            time: time step.
            looked: homes and the furniture that was looked at, (n,) each.
            edge_home: home of every edge, (E,).
            edges_looked_at: those of that furniture, (k,).
            found: edges of which the look says something, and whether it showed them, (m,) each.
        """
        is_known = ~np.isnan(clock[looked[0]].sum(axis=1))
        home, place = looked[0][is_known], looked[1][is_known]
        if not len(home):
            return
        if not self.is_counted:
            self.times = np.full(self.times.shape, NEVER, dtype=np.int32)
        times = self.times[home, place]
        last = times.argmax(axis=1)
        before, now = times[np.arange(len(home)), last], np.full(len(home), time)
        is_new = (before == NEVER) | (_number(clock[home], before) != _number(clock[home], now))
        column, begins = np.full(len(self.times), -1), np.zeros(len(self.times), dtype=bool)
        column[home], begins[home] = np.where(is_new, times.argmin(axis=1), last), is_new
        self.times[home, place, column[home]] = time
        self._grow(len(edge_home))
        begun = edges_looked_at[begins[edge_home[edges_looked_at]]]
        self.states[begun, column[edge_home[begun]]] = 0
        edges, is_shown = found
        is_known = column[edge_home[edges]] >= 0
        cell = edges[is_known], column[edge_home[edges[is_known]]]
        said = np.where(is_shown[is_known], SHOWN, MISSED)
        self.states[cell] = np.maximum(self.states[cell], said)

    def _grow(self, num_edges: int) -> None:
        if num_edges > len(self.states):
            added = max(num_edges, 2 * len(self.states)) - len(self.states)
            self.states = np.pad(self.states, ((0, added), (0, 0)))

    def get_states(self, edges: np.ndarray) -> np.ndarray:
        """Return `states` of any edges, (n,) -> (n, NUM_MOMENTS), a copy."""
        states = np.zeros((len(edges), NUM_MOMENTS), dtype=np.uint8)
        is_counted = edges < len(self.states)
        states[is_counted] = self.states[edges[is_counted]]
        return states

    def to_columns(self, furniture: np.ndarray) -> dict[str, np.ndarray]:
        """Return columns of one home, from which `from_columns` makes the same moments.

        `furniture` is that of each edge, (E,). Moments at a place are in the order of time, and
        those that said the same of an edge are one number: 3 times their count, and what they said.
        """
        order = np.argsort(self.times[0], axis=1, kind="stable")
        times = np.take_along_axis(self.times[0], order, axis=1)
        said = np.take_along_axis(self.get_states(np.arange(len(furniture))), order[furniture], 1)
        ends = np.ones(said.shape, dtype=bool)
        ends[:, :-1] = said[:, 1:] != said[:, :-1]
        edge, column = np.nonzero(ends)
        length = np.diff(column, prepend=-1)
        is_first = np.diff(edge, prepend=-1) > 0
        length[is_first] = column[is_first] + 1
        kept = np.isin(edge, np.flatnonzero(said.any(axis=1)))
        columns = {
            "num_times": (times != NEVER).sum(axis=1),
            "times": times[times != NEVER],
            "num_runs": np.bincount(edge[kept], minlength=len(furniture)),
            "runs": (3 * length + said[edge, column])[kept],
        }
        return {name: columns[name].astype(np.int64) for name in COLUMNS}

    @classmethod
    def from_columns(
        cls, columns: Mapping[str, Any], num_furniture: int, num_edges: int, time: int
    ) -> Moments:
        """Read what `to_columns` returned of a home at a time step.

        Raises:
            ValueError: if they fit no such home.
            KeyError: if one is missing.
        """
        moments = cls(1, num_furniture)
        num_times, num_runs = (
            _read_whole(columns[name], number, NUM_MOMENTS)
            for name, number in (("num_times", num_furniture), ("num_runs", num_edges))
        )
        times = _read_whole(columns["times"], int(num_times.sum()), time)
        runs = _read_whole(columns["runs"], int(num_runs.sum()), 3 * NUM_MOMENTS + SHOWN)
        place = np.repeat(np.arange(num_furniture), num_times)
        if (np.diff(times)[np.diff(place) == 0] < 0).any():
            raise ValueError("times of moments at a place must ascend")
        if len(times):
            moments.times = np.full(moments.times.shape, NEVER, dtype=np.int32)
            column = NUM_MOMENTS - num_times[place] + compute_rank_in_group(place)
            moments.times[0, place, column] = times
        length, said = np.divmod(runs, 3)
        total = np.bincount(np.repeat(np.arange(num_edges), num_runs), length, num_edges)
        if not (((total == NUM_MOMENTS) | (num_runs == 0)).all() and (length > 0).all()):
            raise ValueError(f"moments of an edge must be {NUM_MOMENTS}")
        moments.states = np.zeros((num_edges, NUM_MOMENTS), dtype=np.uint8)
        moments.states[num_runs > 0] = np.repeat(said, length).reshape(-1, NUM_MOMENTS)
        return moments


def _read_whole(values: Any, number: int, most: int) -> np.ndarray:
    """Return that many whole numbers of 0 to `most`; `ValueError` of others."""
    array = np.array(values if len(values) else np.zeros(0, dtype=np.int64))
    if array.shape != (number,) or array.dtype != np.int64:
        raise ValueError(f"moments must have {number} whole numbers")
    if number and not (array.min() >= 0 and array.max() <= most):
        raise ValueError(f"numbers of moments must lie in 0 to {most}")
    return array


def _number(clock: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return in which half hour time steps begin, by the clock of each, (n, 2), (n,) -> (n,)."""
    number: np.ndarray = (clock[:, 0] + time * clock[:, 1]) // MOMENT_SECONDS
    return number


def _make_none(num_homes: int, num_furniture: int) -> np.ndarray:
    return np.broadcast_to(np.int32(NEVER), (num_homes, num_furniture, NUM_MOMENTS))

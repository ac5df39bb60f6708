"""Looks for one thing alone that did not find it: kept of that thing, and read as looks at it.

They say nothing of other things at the place. So the place does not count them, and who asks for
the thing adds them to the looks that the place counts.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from sgm.arrays.table import Table, make_table
from sgm.schema import LONE_LOOKS, NEVER, NUM_LOOKS_KEPT, Columns

# Looks for what no thing is called: the time step of each, and how many, partial ones in part.
SoughtLooks: TypeAlias = tuple[tuple[int, float], ...]


class LoneLooks(NamedTuple):
    """Looks for each of Q things alone, at F furniture nodes.

    Attributes:
        num_looks: how many, int64 (Q, F).
        last: when the last one was, -1 for never, int64 (Q, F).
        query, place, time: of each of the latest ones, which question it is about, where and when
            it was, (n,) each.
    """

    num_looks: np.ndarray
    last: np.ndarray
    query: np.ndarray
    place: np.ndarray
    time: np.ndarray

    @classmethod
    def of(cls, looks: Columns, objects: np.ndarray, num_furniture: int) -> LoneLooks | None:
        """Gather those for objects by row, (Q,), one perhaps twice; None if there are none."""
        is_look = looks["num_looks"] >= 0.5  # parts that are no whole look yet do not count
        is_look &= np.isin(looks["object"], objects)
        if not is_look.any():
            return None
        query, row = np.nonzero(objects[:, None] == np.where(is_look, looks["object"], NEVER))
        place, time = looks["place"][row], looks["time"][row]
        number = np.floor(looks["num_looks"][row] + 0.5).astype(np.int64)
        count = np.zeros((len(objects), num_furniture), dtype=np.int64)
        last = np.full(count.shape, NEVER, dtype=np.int64)
        np.add.at(count, (query, place), number)
        np.maximum.at(last, (query, place), time)
        each = np.repeat(np.arange(len(row)), np.minimum(number, NUM_LOOKS_KEPT))
        return cls(
            num_looks=count, last=last, query=query[each], place=place[each], time=time[each]
        )

    def add_to(self, look_times: np.ndarray) -> np.ndarray:
        """Return the latest of these looks and of others, -1 for none, (Q, F, L) -> (Q, F, L)."""
        num_kept = look_times.shape[2]
        cell = self.query * self.num_looks.shape[1] + self.place
        order = np.lexsort((-self.time, cell))
        cell, time = cell[order], self.time[order]
        rank = np.arange(len(cell)) - np.searchsorted(cell, cell)
        query, place = np.divmod(cell[rank < num_kept], self.num_looks.shape[1])
        latest = np.full(look_times.shape, NEVER, dtype=look_times.dtype)
        latest[query, place, rank[rank < num_kept]] = time[rank < num_kept]
        both: np.ndarray = np.sort(np.concatenate([look_times, latest], axis=2), axis=2)
        return np.ascontiguousarray(both[..., num_kept:])


def note_lone_look(looks: Table, object_row: int, place: int, time: int, coverage: float) -> None:
    """Note a look for an object alone, which had a share of the place in view.

    Looks of one step are a row and count as one, and parts of a look are added up until they are a
    whole one. The oldest of too many rows is added to the next one.
    """
    rows = np.flatnonzero((looks["object"] == object_row) & (looks["place"] == place))
    rows = rows[np.argsort(looks["time"][rows], kind="stable")]
    number, times = looks["num_looks"], looks["time"]
    if len(rows) and (times[rows[-1]] == time or number[rows[-1]] < 0.5):
        times[rows[-1]] = time
        number[rows[-1]] = min(number[rows[-1]] + coverage, max(coverage, 1.0))
    elif len(rows) < NUM_LOOKS_KEPT:
        looks.append(1, object=object_row, place=place, time=time, num_looks=coverage)
    else:
        number[rows[1]] += number[rows[0]]
        times[rows[0]], number[rows[0]] = time, coverage


def add_sought(looks: SoughtLooks, time: int, coverage: float) -> SoughtLooks:
    """Return looks for what no thing is called with one more; as `note_lone_look` keeps them."""
    table = make_table(LONE_LOOKS)
    for when, number in (*looks, (time, coverage)):
        note_lone_look(table, 0, 0, when, number)
    order = np.argsort(table["time"], kind="stable")
    times, numbers = table["time"][order].tolist(), table["num_looks"][order].tolist()
    return tuple(zip(times, numbers, strict=True))

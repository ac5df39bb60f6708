"""Records every snapshot of a rollout as versions: a row for each time a counter changes."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.schema import COUNTERS, SNAPSHOT_TABLES, Column
from simulator.snapshots.shards import EXTRA, PREFIXES, QUESTION_EXTRA
from simulator.snapshots.taken import get_layout

Arrays = dict[str, np.ndarray]


class Recorder:
    """Follows one `MemoryBatch` and turns it into one set of arrays per home.

    A snapshot is not copied: each node and edge leaves a *version* whenever a look changes it,
    valid for the snapshots `valid_from <= s < valid_to`. A step changes some twenty of the
    three hundred edges of a home, so this takes a twentieth of the space of copies, and snapshot
    s is one mask over the versions.
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Start with no snapshot."""
        self._memory = memory
        self._num_snapshots = np.zeros(memory.num_homes, dtype=np.int64)  # so far, (H,)
        self._snapshots: list[Arrays] = []
        self._furniture_rows: list[Arrays] = []  # of each snapshot, padded
        self._versions: dict[str, list[Arrays]] = defaultdict(list)

    def add_snapshot(
        self,
        queries: Queries,
        answers: np.ndarray,
        extras: Mapping[str, np.ndarray] | None = None,
        question_extras: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Record the memories at queries; a home may have several, or none.

        Args:
            queries: what is asked, (Q,); one snapshot each.
            answers: furniture that truly holds the object asked for, bool (Q, F).
            extras: what else to keep of each furniture node, (Q, F) or (Q, F, D) by name; the
                same names each time. float16 stays float16, other numbers become float32.
            question_extras: what else to keep of each question, (Q, D) by name.
        """
        self._snapshots.append(
            {
                "home": queries.home,
                "time": np.full(len(queries.home), self._memory.time, dtype=np.int32),
                "query": queries.object,
            }
            | {f"{QUESTION_EXTRA}{name}": a for name, a in (question_extras or {}).items()}
        )
        self._furniture_rows.append(
            {"prior": queries.prior, "answers": answers}
            | {f"{EXTRA}{name}": array for name, array in (extras or {}).items()}
        )
        self._num_snapshots += np.bincount(queries.home, minlength=self._memory.num_homes)

    def add_change(self, change: Change) -> None:
        """Record what a look has changed; valid from the next snapshot on."""
        memory = self._memory
        for table, rows in (("objects", change.objects), ("edges", change.edges)):
            self._add_versions(table, memory.tables[table]["home"][rows], rows, rows)
        self._add_versions(
            "furniture", change.home, change.furniture, (change.home, change.furniture)
        )

    def finish(self) -> list[Arrays]:
        """Return the arrays of every home; docs/data.md lists them with their shapes."""
        memory, num_homes = self._memory, self._memory.num_homes
        homes = {table: memory.tables[table]["home"] for table in ("objects", "edges")}
        numbers = {table: _number_within(home) for table, home in homes.items()}
        numbers["furniture"] = np.arange(memory.num_furniture)
        snapshots, furniture_rows = (
            {name: np.concatenate([part[name] for part in rows]) for name in rows[0]}
            for rows in (self._snapshots, self._furniture_rows)
        )  # (snapshots of all homes, ...)
        snapshot_home = snapshots.pop("home")
        snapshots["query"] = numbers["objects"][snapshots["query"]]
        parts = [_split_by_home(snapshots, snapshot_home, num_homes, "snapshot_")]
        for table, home in homes.items():
            fixed = {
                column.name: _renumber(memory.tables[table][column.name], column, numbers)
                for column in SNAPSHOT_TABLES[table]
                if column.is_fixed
            }
            parts.append(_split_by_home(fixed, home, num_homes, f"{PREFIXES[table]}_"))
        for table, number in numbers.items():
            versions = self._sort_versions(table)
            home, table_row = versions.pop("home"), versions.pop("row")
            versions["of"] = number[table_row]
            parts.append(_split_by_home(versions, home, num_homes, f"{PREFIXES[table]}_version_"))
        padded = _split_by_home(furniture_rows, snapshot_home, num_homes, "snapshot_furniture_")
        counts = {"rooms": memory.home_num_rooms, "furniture": memory.home_num_furniture}
        arrays = [
            {
                f"{PREFIXES[table]}_{name}": _compact(array[home, : counts[table][home]])
                for table, columns in get_layout(memory).items()
                for name, array in columns.items()
            }
            | {
                name: np.ascontiguousarray(array[:, : counts["furniture"][home]])
                for name, array in padded[home].items()
            }
            | {name: array for part in parts for name, array in part[home].items()}
            for home in range(num_homes)
        ]
        if memory.clock is not None:
            for home_arrays, clock in zip(arrays, memory.clock, strict=True):
                if not np.isnan(clock).any():
                    home_arrays["home_clock"] = clock.copy()  # float64: exact after years of steps
        return arrays

    def _add_versions(self, table: str, home: np.ndarray, rows: np.ndarray, where: Any) -> None:
        columns = self._memory.tables[table]
        values = {name: columns[name][where] for name in COUNTERS[table]}
        valid_from = self._num_snapshots[home]
        self._versions[table].append(
            {"home": home, "row": rows, "valid_from": valid_from, **values}
        )

    def _sort_versions(self, table: str) -> Arrays:
        """Order the versions by home and row, and end each where the next one begins."""
        parts = self._versions[table]
        columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        # Versions were added as time passed, and a stable sort keeps that order.
        key = columns["home"].astype(np.int64) * (int(columns["row"].max(initial=0)) + 1)
        key += columns["row"]
        order = np.argsort(key, kind="stable")
        key = key[order]
        columns = {name: column[order] for name, column in columns.items()}
        following = np.append(columns["valid_from"][1:], 0)
        is_last = np.append(key[1:] != key[:-1], True)[: len(key)]
        columns["valid_to"] = np.where(
            is_last, self._num_snapshots[columns["home"]], following[: len(key)]
        )
        return columns


def _renumber(values: np.ndarray, column: Column, numbers: Mapping[str, np.ndarray]) -> np.ndarray:
    """Let a column name rows of other tables by their number within the home."""
    return numbers[column.refers_to][values] if column.refers_to in numbers else values


def _number_within(home: np.ndarray) -> np.ndarray:
    """Number the rows of each home in their order, (n,) -> (n,)."""
    order = np.argsort(home, kind="stable")
    number = np.empty(len(home), dtype=np.int32)
    number[order] = compute_rank_in_group(home[order])
    return number


def _split_by_home(columns: Arrays, home: np.ndarray, num_homes: int, prefix: str) -> list[Arrays]:
    """Split the rows (n,) of all homes into those of each, in their order, ready for the disk."""
    order = np.argsort(home, kind="stable")
    bounds = np.searchsorted(home[order], np.arange(num_homes + 1))
    whole = {f"{prefix}{name}": _compact(column[order]) for name, column in columns.items()}
    return [
        {name: column[start:end] for name, column in whole.items()}
        for start, end in itertools.pairwise(bounds.tolist())
    ]


def _compact(array: np.ndarray) -> np.ndarray:
    """Give an array its type on disk: int32, float32, float16 or uint8, in C order."""
    if array.dtype == np.float16:
        return np.ascontiguousarray(array)
    dtype = {"b": np.uint8, "f": np.float32}.get(array.dtype.kind, np.int32)
    return np.ascontiguousarray(array, dtype=dtype)

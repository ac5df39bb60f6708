"""Rows of a table that become one: what each column is then, as its declaration says."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sgm.schema import NEVER, Column, Columns, PlaceCode


@dataclass(frozen=True, slots=True)
class Groups:
    """Which of n rows become one, G of them.

    Attributes:
        of_row: number of the group of each row, (n,).
        kept: the row of each group that stays, in ascending order, (G,).
    """

    of_row: np.ndarray
    kept: np.ndarray

    def choose(self, keys: Sequence[np.ndarray], among: np.ndarray | None = None) -> np.ndarray:
        """Return the row of each group with the highest values, compared in turn, (G,).

        Of equal rows, that is the last; -1 for groups without any.

        Args:
            keys: values of all rows, (n,) each, the first of them compared first.
            among: the rows that may be chosen, ascending; None for all.
        """
        rows = np.arange(len(self.of_row)) if among is None else among
        turns = [*reversed(keys), self.of_row]
        rows = rows[np.lexsort([values[rows] for values in turns])]
        chosen = np.full(len(self.kept), -1)
        chosen[self.of_row[rows]] = rows  # the last of each group
        return chosen


def group_places(columns: Columns, is_first: np.ndarray | None = None) -> Groups:
    """Find the rows of one object, furniture node and relation.

    The first of them stays, or that which `is_first` marks, bool (n,). Those that stay are in the
    order of the rows.
    """
    place = columns["furniture"].astype(np.int64)
    place = place + columns["object"].astype(np.int64) * (place.max(initial=0) + 1)
    key = PlaceCode.of(place, columns["relation"])
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    if is_first is not None:
        first = Groups(group, first).choose([is_first])
    order = np.argsort(first)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    return Groups(number[group], first[order])


def merge_rows(
    declared: Iterable[Column], columns: Columns, groups: Groups, *, same_looks: bool = False
) -> dict[str, np.ndarray]:
    """Return declared columns of rows that become one, (G,) each.

    Args:
        declared: the columns, each behind that which it is bounded by.
        columns: of all rows, (n,) each.
        groups: which rows become one.
        same_looks: whether they were held against the same looks; see `sgm.schema.Merge`.
    """
    merged: dict[str, np.ndarray] = {}
    for column in declared:
        rule = column.merges
        assert rule is not None  # `check_columns`
        how = rule.same_looks if same_looks and rule.same_looks else rule.how
        keys = [columns[name] for name in rule.columns]
        values = _merge(how, columns[column.name], groups, keys, column.default)
        merged[column.name] = np.minimum(values, merged[rule.most]) if rule.most else values
    return merged


def _merge(
    how: str, values: np.ndarray, groups: Groups, keys: Sequence[np.ndarray], default: float
) -> np.ndarray:
    """Return the merged values of a column, (n,) -> (G,)."""
    kept = values[groups.kept]
    if how == "own":
        return kept
    if how in ("newest", "known"):
        among = np.flatnonzero(values != default) if how == "known" else None
        rows = groups.choose(keys, among)
        return np.where(rows >= 0, values[rows], kept)
    if how == "sum":
        return _sum(values, groups.of_row, len(kept))
    if how == "mean":
        weight = keys[0].astype(float)
        total = np.bincount(groups.of_row, weight, len(kept))
        mean: np.ndarray = np.bincount(groups.of_row, weight * values, len(kept)) / total
        return mean
    if how == "first":
        never = np.iinfo(np.int64).max
        times = np.full(len(kept), never)
        np.minimum.at(times, groups.of_row, np.where(values == NEVER, never, values))
        return np.where(times == never, NEVER, times)
    extreme = {"max": np.maximum, "min": np.minimum}[how]
    extreme.at(kept, groups.of_row, values)
    return kept


def join_hours(hours: np.ndarray, groups: Groups) -> np.ndarray:
    """Return `HomeHistory.edge_hours` of edges of which some became one.

    (2, n, hours) -> (2, G, hours)
    """
    num_groups = len(groups.kept)
    summed = np.stack([_sum(counts, groups.of_row, num_groups) for counts in hours])
    return np.minimum(summed, np.iinfo(hours.dtype).max).astype(hours.dtype)


def _sum(values: np.ndarray, group: np.ndarray, num_groups: int) -> np.ndarray:
    """Return the sums of groups, (n, ...) -> (G, ...), as 64-bit numbers."""
    wide = np.float64 if np.issubdtype(values.dtype, np.floating) else np.int64
    total = np.zeros((num_groups, *values.shape[1:]), dtype=wide)
    np.add.at(total, group, values.astype(wide))
    return total

"""Arrays that hold several groups one after the other, or rows that are filled up.

And those whose last axis is of the relations of a place: numpy's own reductions of it take a call
for each place.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np


def compute_rank_in_group(groups: np.ndarray) -> np.ndarray:
    """Number the entries within each run of equal values of an ascending array, (n,) -> (n,)."""
    if len(groups) == 0:
        return np.zeros(0, dtype=np.int64)
    index = np.arange(len(groups))
    is_start = np.ones(len(groups), dtype=bool)
    np.not_equal(groups[1:], groups[:-1], out=is_start[1:])
    start = np.where(is_start, index, 0)
    return index - np.maximum.accumulate(start, out=start)


def compute_starts(counts: np.ndarray) -> np.ndarray:
    """Return the first entry of each group and, last, the number of entries, (n,) -> (n + 1,)."""
    starts = np.zeros(len(counts) + 1, dtype=np.int64)
    np.cumsum(counts, out=starts[1:])
    return starts


def concatenate_ranges(starts: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return start, start + 1, ..., start + count - 1 of every range in turn, (sum(counts),)."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    return np.arange(total) + np.repeat(starts - (ends - counts), counts)


def number_keys(size: int, *keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number the keys that occur, in ascending order; keys lie in 0..size-1, with repetitions.

    Returns:
        The keys that occur, ascending, (n,), and the number of every key, int32 (size,).
    """
    found = np.flatnonzero(mark_rows(np.concatenate(keys), size))
    number = np.zeros(size, dtype=np.int32)
    number[found] = np.arange(len(found))
    return found, number


def mark_rows(rows: np.ndarray, num_rows: int) -> np.ndarray:
    """Mark the rows that occur, bool (num_rows,)."""
    occurs = np.zeros(num_rows, dtype=bool)
    occurs[rows] = True
    return occurs


def join_groups(asked: np.ndarray, group: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Find the members of groups.

    Groups are asked for in any order and more than once, (Q,); `group` is that to which each
    member belongs, in 0..size-1, (n,).

    Returns:
        (k,) positions in `asked` and (k,) members; members ascending.
    """
    if len(asked) == 1:  # as one robot asks
        member = np.flatnonzero(group == asked[0])
        return np.zeros(len(member), dtype=np.int64), member
    num_asked = np.bincount(asked, minlength=size)
    member = np.flatnonzero((num_asked > 0).take(group))
    group_of_member = group[member]
    count = num_asked[group_of_member]
    start = (np.cumsum(num_asked) - num_asked)[group_of_member]
    position = np.argsort(asked, kind="stable")[concatenate_ranges(start, count)]
    return position, np.repeat(member, count)


def sum_rows(values: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Sum the first entries of rows, as many as each has, (n, ..., F), (n,) -> (n, ...).

    The others may be zero, but not even they may be added: how a sum is rounded depends on the
    length of the row, and so on the longest row beside it.
    """
    if (lengths == values.shape[-1]).all():
        return np.ascontiguousarray(values).sum(axis=-1)
    total = np.zeros(values.shape[:-1], dtype=values.dtype)
    for length in np.unique(lengths):
        rows = lengths == length
        total[rows] = np.ascontiguousarray(values[rows, ..., :length]).sum(axis=-1)
    return total


def share_rows(values: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scale rows to a sum of one, (n, ..., F), and say which have one, bool (n, ...).

    `lengths` as in `sum_rows`.
    """
    total = sum_rows(values, lengths)
    is_some = total > 1e-9
    where = is_some[..., None]
    return np.divide(values, total[..., None], out=np.zeros_like(values), where=where), is_some


def pad_rows(rows: Sequence[Sequence[Any] | np.ndarray], fill: object, dtype: Any) -> np.ndarray:
    """Put H rows of up to W values into one array, (H, W), with `fill` beyond the end of each."""
    padded = np.full((len(rows), max(map(len, rows), default=0)), fill, dtype=dtype)
    for padded_row, values in zip(padded, rows, strict=True):
        padded_row[: len(values)] = values
    return padded


def max_relations(values: np.ndarray) -> np.ndarray:
    """Return the highest value of each place, (..., relations) -> (...)."""
    return reduce(np.maximum, (values[..., number] for number in range(values.shape[-1])))


def sum_relations(values: np.ndarray) -> np.ndarray:
    """Return the sum of the values of each place, (..., relations) -> (...)."""
    return reduce(np.add, (values[..., number] for number in range(values.shape[-1])))


def share_relations(values: np.ndarray) -> np.ndarray:
    """Return values as shares of their sum at each place, alike where it is 0, (..., relations)."""
    total = sum_relations(values)[..., None]
    return np.where(total > 0, values / np.where(total > 0, total, 1), 1 / values.shape[-1])


def choose_relations(values: np.ndarray, *, last: bool = False) -> np.ndarray:
    """Return the relation of the highest value at each place, int64 (..., relations) -> (...).

    Of equal values, the first, or the `last`.
    """
    highest, chosen = values[..., 0], np.zeros(values.shape[:-1], dtype=np.int64)
    for number in range(1, values.shape[-1]):
        value = values[..., number]
        is_higher = value >= highest if last else value > highest
        highest, chosen = np.maximum(value, highest), np.where(is_higher, number, chosen)
    return chosen

"""What follows from declared columns: tables, files, the check of what was read, rows that stay."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.arrays.table import Table
from sgm.messages import shorten
from sgm.schema import NOW, TABLES, Column, Columns

Tables = Mapping[str, Columns]  # columns by table and name, one number per row


def _get_part(table: str) -> str:
    """Return how a file calls a table; its "furniture" are the nodes themselves."""
    return "furniture_counters" if table == "furniture" else table


def list_written(table: str) -> tuple[Column, ...]:
    """Return the columns of a table that files hold."""
    return tuple(column for column in TABLES[table] if not column.is_derived)


def list_parts() -> tuple[str, ...]:
    """Return how a file calls the tables."""
    return tuple(map(_get_part, TABLES))


def make_empty_tables() -> Tables:
    """Return tables without rows."""
    none = np.zeros(0, dtype=np.int64)
    return {table: {column.name: none for column in list_written(table)} for table in TABLES}


def view_tables(tables: Mapping[str, Table]) -> Tables:
    """Return what the tables of a memory of one home hold: views, which change with it."""
    return {
        table: {column.name: columns[column.name].reshape(-1) for column in list_written(table)}
        for table, columns in tables.items()
    }


def fill_tables(tables: Mapping[str, Table], content: Tables) -> None:
    """Write what was read into the tables of a memory of one home, which have all their rows."""
    for table, columns in content.items():
        for name, column in columns.items():
            tables[table][name][...] = column


def keep_rows(content: Tables, kept: Mapping[str, np.ndarray]) -> tuple[Tables, np.ndarray]:
    """Leave out rows of furniture and objects that are not `kept`, and the edges to them.

    Returns:
        The tables, where rows are named by their new positions, and which edges stay, bool (E,).
    """
    place = {
        table: np.append(np.where(keep, np.cumsum(keep) - 1, -1), -1)  # the last: of -1
        for table, keep in kept.items()
    }
    stays: dict[str, np.ndarray] = {}
    left = {}
    for table, columns in content.items():
        num_rows = len(next(iter(columns.values())))
        stay = kept.get(table, np.ones(num_rows, dtype=bool))
        new = dict(columns)
        for column in list_written(table):
            if column.refers_to in place:
                new[column.name] = place[column.refers_to][columns[column.name]]
                if column.low == 0:  # it must name one
                    stay = stay & (new[column.name] >= 0)
        stays[table] = stay
        left[table] = {name: values[stay] for name, values in new.items()}
    return left, stays["edges"]


def write_tables(content: Tables) -> dict[str, dict[str, np.ndarray]]:
    """Return the tables as 64-bit numbers, without the columns that are as guessed."""
    written: dict[str, dict[str, np.ndarray]] = {}
    objects = _widen("objects", content["objects"])
    for table in TABLES:
        columns, part = _widen(table, content[table]), written.setdefault(_get_part(table), {})
        for column in list_written(table):
            values = columns[column.name]
            guess = column.make_guess(columns, objects, len(values)) if part else None
            if guess is None or not np.array_equal(values, guess):
                part[column.name] = values
    return written


def read_tables(data: Mapping[str, Any]) -> Tables:
    """Read what `write_tables` returned.

    A missing part raises KeyError or TypeError, and columns of another kind ValueError.
    """
    content: dict[str, dict[str, np.ndarray]] = {}
    for table in TABLES:
        columns, part = content.setdefault(table, {}), data[_get_part(table)]
        first, *others = list_written(table)
        columns[first.name] = _read_column(first, part[first.name])
        num_rows = len(columns[first.name])
        for column in others:
            columns[column.name] = (
                _read_column(column, part[column.name])
                if column.name in part
                else column.make_guess(columns, content.get("objects", {}), num_rows)
            )
    return content


def check_tables(content: Tables, num_rows: Mapping[str, int], time: int) -> None:
    """Raise ValueError unless every column has all rows of its table, within its bounds."""
    for table, columns in content.items():
        for column in list_written(table):
            values = columns[column.name]
            name = f"{_get_part(table)} {column.name}"
            if len(values) != num_rows[table]:
                raise ValueError(f"{name}: {len(values)} rows instead of {num_rows[table]}")
            high = time if column.high == NOW else column.high
            if column.refers_to:
                high = num_rows[column.refers_to] - 1
            wrong = ~((values >= column.low) & (values <= high))
            if wrong.any():
                raise ValueError(
                    f"{name} must lie in {column.low:g} to {high:g}, got "
                    f"{shorten(values[wrong][0].item())}"
                )


def _widen(table: str, columns: Columns) -> Columns:
    """Return the columns that files hold as 64-bit numbers."""
    return {
        column.name: columns[column.name].astype(np.int64 if column.is_whole else float)
        for column in list_written(table)
    }


def _read_column(column: Column, values: Any) -> np.ndarray:
    """Read one column; `ValueError` if it is of another kind."""
    dtype = np.dtype(np.int64 if column.is_whole else float)
    array = np.array(values if len(values) else np.zeros(0, dtype))
    if array.ndim != 1 or array.dtype != dtype:
        raise ValueError(f"{column.name} must be {'whole ' * column.is_whole}numbers")
    return array

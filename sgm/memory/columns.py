"""The columns of a memory's tables, declared once: what they are, and how they stand in files.

Everything that goes over all columns follows from this: tables, copies, files, the check of what
was read, and what is left when rows are removed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sgm.arrays.table import Table
from sgm.checks import MOST_METRES
from sgm.memory.clock import MAX_TIME
from sgm.messages import shorten

NEVER = -1  # time stamp of what has not happened
NOW = -2.0  # as an upper bound: the time step of the memory

Columns = Mapping[str, np.ndarray]  # of one table, by name


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        name: within its table.
        dtype: in memory; in files whole numbers are whole, and others are numbers.
        default: of new rows.
        low, high: what it may be; `NOW` for the time step of the memory.
        refers_to: table whose rows it names by position, within bounds of their own; low is -1
            where it may name none.
        guess: what it is in most homes, of the columns declared before it and the table of objects;
            None for the default. A column that is as guessed is left out of a file, which is a
            quarter smaller so; the first of a table is always there.
        is_counter: whether it is one of the paper's, which snapshots and shards have, too.
        is_derived: whether it is looked up: it is in no file.
    """

    name: str
    dtype: type = np.int32
    default: float = 0
    low: float = 0
    high: float = MAX_TIME
    refers_to: str = ""
    guess: Callable[[Columns, Columns], np.ndarray] | None = None
    is_counter: bool = False
    is_derived: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether its numbers are whole."""
        return not np.issubdtype(self.dtype, np.floating)

    def make_guess(self, own: Columns, objects: Columns, num_rows: int) -> np.ndarray:
        """Return what stands for it where a file does not have it, (num_rows,)."""
        if self.guess is not None:
            return self.guess(own, objects)
        return np.full(num_rows, self.default, dtype=np.int64 if self.is_whole else float)


def make_table(columns: Sequence[Column], shape: tuple[int, ...] = (), num_rows: int = 0) -> Table:
    """Make a table of columns; see `Table`."""
    defaults = {column.name: column.default for column in columns}
    return Table({column.name: column.dtype for column in columns}, defaults, shape, num_rows)


_count = partial(Column, is_counter=True)
_stamp = partial(Column, default=NEVER, low=NEVER, high=NOW)  # a time step, `NEVER` at first


def _guess_first_observed(own: Columns, objects: Columns) -> np.ndarray:
    """The start stands for the first of several sightings."""
    return np.where(own["num_observed"] < 2, own["last_observed"], 0)


def _guess_true(own: Columns, objects: Columns) -> np.ndarray:
    """An edge is true if the last look found it so."""
    is_last = own["last_observed"] == own["last_true"]
    return ((own["num_true"] > 0) & is_last).astype(np.int64)


def _guess_time_true(own: Columns, objects: Columns) -> np.ndarray:
    """It was true for that share of the time since the first sighting at which looks found it."""
    known = own["last_observed"] - objects["first_observed"][own["object"]]
    share = known * own["num_true"] // np.maximum(own["num_observed"], 1)
    return np.where(own["num_true"], share, 0)


def _guess_absent(own: Columns, objects: Columns) -> np.ndarray:
    """All looks that did not show it came after those that did."""
    return np.where(own["is_true"], 0, own["num_observed"] - own["num_true"])


# `Remembered` says what each column holds.
FURNITURE = (_count("num_observed"), _stamp("last_observed", is_counter=True))
OBJECTS = (
    *(Column(name, is_derived=True) for name in ("home", "key", "label")),
    Column("type", low=-1, is_derived=True),
    _count("num_observed"),
    _stamp("last_observed", is_counter=True),
    _count("num_moved"),
    _stamp("last_moved", is_counter=True),
    Column("last_furniture", default=NEVER, low=NEVER, refers_to="furniture"),
    _stamp("first_observed", guess=_guess_first_observed),
    Column("num_at_once", guess=lambda own, _: np.minimum(own["num_observed"], 1)),
    Column("num_sought"),
    Column("num_still"),
    _stamp("carried_since"),
    Column("same_as", default=-1, low=-1, refers_to="objects"),
)
EDGES = (
    Column("home", is_derived=True),
    Column("object", refers_to="objects"),
    Column("furniture", refers_to="furniture"),
    Column("relation", high=1),
    Column("prior", np.float32, is_derived=True),
    _count("num_observed"),
    _count("num_true"),
    _count("num_changed"),
    _stamp("last_observed", is_counter=True),
    _stamp("last_changed", is_counter=True),
    _stamp("last_true", is_counter=True),
    _count("is_true", dtype=np.bool_, high=1, guess=_guess_true),
    Column("num_absent", guess=_guess_absent),
    Column("time_true", guess=_guess_time_true),
    # All looks were whole ones, and all sightings sure.
    Column("missed", np.float32, guess=lambda own, _: own["num_absent"].astype(float)),
    Column(
        "confidence",
        np.float32,
        high=1,
        guess=lambda own, _: (own["num_true"] > 0).astype(float),
    ),
    Column("came_from", default=NEVER, low=NEVER, refers_to="furniture"),
)
_metres = partial(Column, dtype=np.float64, low=-MOST_METRES, high=MOST_METRES)
# Where things were seen, in the frame of the map; `Remembered` says what each holds.
POSITIONS = (
    Column("object", refers_to="objects"),
    Column("furniture", refers_to="furniture"),
    Column("relation", high=1),
    _stamp("time"),
    Column("num_seen", default=1, low=1),
    *(_metres(name) for name in ("x", "y", "z")),
    Column("sd", np.float64, default=-1, low=-1, high=MOST_METRES),
    *(_metres(f"usual_{name}") for name in ("x", "y", "z")),
)
# One row for each home; `HomeHistory` says what each holds.
HOME = tuple(
    Column(name, np.float64, high=np.inf)
    for name in (
        "num_asked", "num_found", "num_last_right", "num_common_right", "num_prior_right",
        "num_moved", "time_followed", "num_missed", "num_refound",
    )
)  # fmt: skip
TABLES = {  # of a home, by name
    "furniture": FURNITURE, "objects": OBJECTS, "edges": EDGES, "positions": POSITIONS,
}  # fmt: skip

FURNITURE_COUNTERS, OBJECT_COUNTERS, EDGE_COUNTERS = (
    tuple(column.name for column in columns if column.is_counter)
    for columns in (FURNITURE, OBJECTS, EDGES)
)
Tables = Mapping[str, Columns]  # columns by table and name, one number per row


def _get_part(table: str) -> str:
    """Return how a file calls a table; its "furniture" are the nodes themselves."""
    return "furniture_counters" if table == "furniture" else table


def list_written(table: str) -> tuple[Column, ...]:
    """Return the columns of a table that files hold."""
    return tuple(column for column in TABLES[table] if not column.is_derived)


def make_empty_tables() -> Tables:
    """Return tables without rows."""
    none = np.zeros(0, dtype=np.int64)
    return {table: {column.name: none for column in list_written(table)} for table in TABLES}


def view_tables(tables: Mapping[str, Table]) -> Tables:
    """Return what the tables of a memory of one home hold: views, which change with it."""
    return {
        table: {column.name: own[column.name].reshape(-1) for column in list_written(table)}
        for table, own in tables.items()
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


def write_tables(content: Tables) -> dict[str, dict[str, list[float]]]:
    """Return the tables as JSON values, without the columns that are as guessed."""
    written: dict[str, dict[str, list[float]]] = {}
    objects = _widen("objects", content["objects"])
    for table in TABLES:
        columns, part = _widen(table, content[table]), written.setdefault(_get_part(table), {})
        for column in list_written(table):
            values = columns[column.name]
            guess = column.make_guess(columns, objects, len(values)) if part else None
            if guess is None or not np.array_equal(values, guess):
                part[column.name] = values.tolist()
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
            what = f"{_get_part(table)} {column.name}"
            if len(values) != num_rows[table]:
                raise ValueError(f"{what}: {len(values)} rows instead of {num_rows[table]}")
            high = time if column.high == NOW else column.high
            if column.refers_to:
                high = num_rows[column.refers_to] - 1
            wrong = ~((values >= column.low) & (values <= high))
            if wrong.any():
                raise ValueError(
                    f"{what} must lie in {column.low:g} to {high:g}, got "
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
    array = np.array(values or np.zeros(0, dtype))
    if array.ndim != 1 or array.dtype != dtype:
        raise ValueError(f"{column.name} must be {'whole ' * column.is_whole}numbers")
    return array

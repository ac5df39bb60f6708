"""The columns of a memory's tables, declared once: what they are, and how they stand in files.

Everything that goes over all columns follows from this: tables, copies, files, what is read of
files of earlier versions, the check of what was read, and what is left when rows are removed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sgm.arrays.table import Table
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
        default: of new rows, and of all rows of files of versions before `since`.
        low, high: what it may be; `NOW` for the time step of the memory.
        refers_to: table whose rows it names by position, within bounds of their own; low is -1
            where it may name none.
        since: version of memory files that first has it.
        guess: what stands for it where a file does not have it, of the columns declared before it
            and the table of objects; a column that is as guessed is in no file. None for the
            default, which a column of version 1 must be without.
        is_counter: whether it is one of the paper's, which snapshots and shards have, too.
        is_derived: whether it is looked up: it is in no file.
        part: of a file that it stands in, where that is not its table's.
    """

    name: str
    dtype: type = np.int32
    default: float = 0
    low: float = 0
    high: float = MAX_TIME
    refers_to: str = ""
    since: int = 1
    guess: Callable[[Columns, Columns], np.ndarray] | None = None
    is_counter: bool = False
    is_derived: bool = False
    part: str = ""

    @property
    def is_optional(self) -> bool:
        """Whether files need not have it."""
        return self.since > 1 or self.guess is not None

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


def _guess_true(own: Columns, objects: Columns) -> np.ndarray:
    """An edge is true if the last look found it so."""
    is_last = own["last_observed"] == own["last_true"]
    return ((own["num_true"] > 0) & is_last).astype(np.int64)


def _guess_time_true(own: Columns, objects: Columns) -> np.ndarray:
    """It was true for that share of the time since the first sighting at which looks found it."""
    known = own["last_observed"] - objects["first_observed"][own["object"]]
    share = known * own["num_true"] // np.maximum(own["num_observed"], 1)
    return np.where(own["num_true"], share, 0)


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
    # The start stands for the first of several sightings; of everything one was seen at once.
    _stamp("first_observed", since=3,
           guess=lambda own, _: np.where(own["num_observed"] < 2, own["last_observed"], 0)),
    Column("num_at_once", since=3, guess=lambda own, _: np.minimum(own["num_observed"], 1)),
    Column("num_sought", since=4),
    Column("num_still", since=4),
    _stamp("carried_since", since=5),
    Column("same_as", default=-1, low=-1, refers_to="objects", since=5),
)  # fmt: skip
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
    # All false looks stand for the last ones, all looks were whole ones, and all sightings sure.
    Column("num_absent", since=3,
           guess=lambda own, _: np.where(own["is_true"], 0, own["num_observed"] - own["num_true"])),
    Column("time_true", since=4, guess=_guess_time_true),
    Column("missed", np.float32, since=3, part="edge_measures",
           guess=lambda own, _: own["num_absent"].astype(float)),
    Column("confidence", np.float32, high=1, since=3, part="edge_measures",
           guess=lambda own, _: (own["num_true"] > 0).astype(float)),
)  # fmt: skip
# One row for each home; `HomeHistory` says what each holds. Its files have all of them, or none.
HOME = tuple(
    Column(name, np.float64, high=np.inf, since=3)
    for name in (
        "num_asked", "num_found", "num_last_right", "num_common_right", "num_prior_right",
        "num_moved", "time_followed", "num_missed", "num_refound",
    )
)  # fmt: skip
TABLES = {"furniture": FURNITURE, "objects": OBJECTS, "edges": EDGES}  # of a home, by name

FURNITURE_COUNTERS, OBJECT_COUNTERS, EDGE_COUNTERS = (
    tuple(column.name for column in columns if column.is_counter) for columns in TABLES.values()
)
Tables = Mapping[str, Columns]  # columns by table and name, one number per row

_PART = {"furniture": "furniture_counters"}  # of a file; "furniture" are the nodes themselves


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
    """Return the tables as JSON values, without what is read so if it is not there."""
    written: dict[str, dict[str, list[float]]] = {}
    objects = _widen("objects", content["objects"])
    for table in TABLES:
        columns = _widen(table, content[table])
        for column in list_written(table):
            values = columns[column.name]
            part = written.setdefault(column.part or _PART.get(table, table), {})
            guess = column.make_guess(columns, objects, len(values))
            if not column.is_optional or not np.array_equal(values, guess):
                part[column.name] = values.tolist()
    return written


def read_tables(data: Mapping[str, Any], num_furniture: int) -> Tables:
    """Read what `write_tables` returned, or an earlier version.

    Missing columns raise KeyError or TypeError, and those of another kind ValueError.
    """
    content: dict[str, dict[str, np.ndarray]] = {}
    for table in TABLES:
        columns = content[table] = {}
        num_rows = num_furniture
        for column in list_written(table):
            part = data[_PART.get(table, table)]
            if column.part:
                part = data.get(column.part, {})
            if column.name in part or not column.is_optional:
                columns[column.name] = _read_column(column, part[column.name])
                num_rows = len(columns[column.name])
            else:
                objects = content.get("objects", {})
                columns[column.name] = column.make_guess(columns, objects, num_rows)
    return content


def check_tables(content: Tables, num_rows: Mapping[str, int], time: int) -> None:
    """Raise ValueError unless every column has all rows of its table, within its bounds."""
    for table, columns in content.items():
        for column in list_written(table):
            values = columns[column.name]
            what = f"{_PART.get(table, table)} {column.name}"
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

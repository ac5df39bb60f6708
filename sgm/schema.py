"""What a graph of a home is made of: nodes, edges, relations, places, and columns of its tables.

It imports nothing of ours, and all that speaks of these imports it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

NODE_TYPES = ("house", "floor", "room", "furniture", "object")
# How a thing lies at furniture, by number.
RELATIONS = ("in", "onTop")
NUM_RELATIONS = len(RELATIONS)
USUAL_RELATION = "onTop"  # where nothing is said or known
# What an edge says of its two nodes, in either direction.
EDGE_RELATIONS = ("in", "contains", "onTop", "under")
OPPOSITES = {"in": "contains", "onTop": "under"}  # of each of `RELATIONS`, from the furniture
EDGE_TYPES = (
    ("house", "contains", "floor"),
    ("floor", "in", "house"),
    ("floor", "contains", "room"),
    ("room", "in", "floor"),
    ("room", "contains", "furniture"),
    ("furniture", "in", "room"),
    ("furniture", "contains", "object"),
    ("object", "in", "furniture"),
    ("object", "onTop", "furniture"),
    ("furniture", "under", "object"),
)
QUERY_EDGE_TYPES = tuple(("object", relation, "furniture") for relation in RELATIONS)
MOST_METRES = 1e5  # of any coordinate: farther away nothing is in a home
MAX_TIME = 2**31 - 2  # time stamps are 32-bit integers

Code = TypeVar("Code", int, np.ndarray)


class PlaceCode:
    """A place and how things lie there as one number, of whole numbers or of arrays of any shape.

    A place is furniture by its position in a home, or whatever is numbered likewise. The code -1 is
    of no place, and its furniture is -1.
    """

    @staticmethod
    def of(furniture: Code, relation: Code) -> Code:
        """Return the code of furniture and of a relation by its number in `RELATIONS`."""
        return furniture * NUM_RELATIONS + relation

    @staticmethod
    def furniture(code: Code) -> Code:
        """Return the furniture of a code."""
        return code // NUM_RELATIONS

    @staticmethod
    def relation(code: Code) -> Code:
        """Return the relation of a code by its number."""
        return code % NUM_RELATIONS

    @staticmethod
    def split(code: Code) -> tuple[Code, Code]:
        """Return furniture and relation of a code."""
        return code // NUM_RELATIONS, code % NUM_RELATIONS

    @staticmethod
    def count(num_furniture: Code) -> Code:
        """Return how many codes so much furniture has; they are the numbers below."""
        return num_furniture * NUM_RELATIONS


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
        refers_to: table whose rows, or "labels", which it names by position, within bounds of their
            own; low is -1 where it may name none.
        guess: what it is in most homes, of the columns declared before it and the table of objects;
            None for the default. A column that is as guessed is left out of a file, which is a
            quarter smaller so; the first of a table is always there.
        is_counter: whether snapshots have it as it was at each moment: the paper's counters.
        is_fixed: whether snapshots have it as what does not change.
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
    is_fixed: bool = False
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


_count = partial(Column, is_counter=True)
_fixed = partial(Column, is_fixed=True)
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
    Column("home", is_derived=True),
    _fixed("key", is_derived=True),
    _fixed("label", refers_to="labels", is_derived=True),
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
    _fixed("object", refers_to="objects"),
    _fixed("furniture", refers_to="furniture"),
    _fixed("relation", high=NUM_RELATIONS - 1),
    _fixed("prior", np.float32, is_derived=True),
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
    Column("relation", high=NUM_RELATIONS - 1),
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

# What snapshots know of the layout of homes; `Snapshots` says what each holds.
ROOM_LAYOUT = (_fixed("label", refers_to="labels"),)
FURNITURE_LAYOUT = (
    _fixed("label", refers_to="labels"),
    _fixed("room", refers_to="rooms"),
    _fixed("prob", np.float32),
)
SNAPSHOT_TABLES = {  # of memories at moments, in memory and on disk
    table: tuple(column for column in columns if column.is_fixed or column.is_counter)
    for table, columns in {
        "rooms": ROOM_LAYOUT,
        "furniture": FURNITURE_LAYOUT + FURNITURE,
        "objects": OBJECTS,
        "edges": EDGES,
    }.items()
}
FIXED, COUNTERS = (
    {
        table: tuple(column.name for column in columns if getattr(column, mark))
        for table, columns in SNAPSHOT_TABLES.items()
    }
    for mark in ("is_fixed", "is_counter")
)

"""What a graph of a home is made of: nodes, edges, relations, places, and columns of its tables.

It imports nothing of ours, and all that speaks of these imports it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np


@dataclass(frozen=True, slots=True)
class NodeType:
    """A level of the graph of a home: what its nodes are in, and where they are listed.

    Attributes:
        parent: type of the node that each one is in; empty for the whole.
        table: of the snapshots that lists them, with `label`, `snapshot` and, by the name of the
            parent, the row of the node that each one is in. Empty where a home has one, which is
            called as its type.
        is_remembered: whether looks tell where they are: a `RELATIONS` each, in the table of edges.
        holds: type of the nodes that may be in one, beside those whose parent it is. Their table
            has a column by the name of this type: the row of the one that each is in, -1 for none.
    """

    parent: str = ""
    table: str = ""
    is_remembered: bool = False
    holds: str = ""


# From the whole to its parts. Batches, graphs and networks have every type that is declared here.
NODE_TABLE = {
    "house": NodeType(),
    "floor": NodeType("house"),
    "room": NodeType("floor", table="rooms"),
    "furniture": NodeType("room", table="furniture"),
    "object": NodeType("furniture", table="objects", is_remembered=True),
}
NODE_TYPES = tuple(NODE_TABLE)  # by number
# Of which a home has one each. Their names are its labels, and labels of all homes begin with them.
HOME_LABELS = tuple(name for name, node in NODE_TABLE.items() if not node.table)


def check_node_types(table: Mapping[str, NodeType]) -> None:
    """Check that all node types say what they are in and where they are listed.

    Raises:
        ValueError: if one does not.
    """
    for number, (name, node) in enumerate(table.items()):
        before = [*table][:number]
        if node.parent not in (before if number else ("",)):
            rule, value = "have a parent that is declared before it", node.parent
        elif node.holds and node.holds not in table:
            rule, value = "hold a declared type", node.holds
        elif not node.table and node.parent and table[node.parent].table:
            rule, value = "have a table below a type that has one", node.table
        else:
            continue
        raise ValueError(f"node type {name} must {rule}, got {value!r}. Mend its row (schema.py).")


check_node_types(NODE_TABLE)
# Child and parent that an edge "contains" and an edge "in" join, whatever looks have shown.
LAYOUT_PAIRS = tuple(
    pair
    for name, node in NODE_TABLE.items()
    for pair in ((name, node.parent), (node.holds, name))
    if all(pair) and not (pair[0] == name and node.is_remembered)
)


@dataclass(frozen=True, slots=True)
class Relation:
    """How a thing lies at furniture, and what follows from that wherever it is read.

    The volume of such things is that of `sgm.layout.box.Box.volume`.

    Attributes:
        opposite: name of the same edge, from the furniture to the thing.
        preposition: of the furniture: "look PREPOSITION the table". It is understood as the name.
        adverb: of the thing: "it is ADVERB". It is understood as the name.
        part: of the furniture, which shows such things.
        is_inside: whether the furniture must have an inside for it. A door hides such things, and
            one sees them through the open front alone.
        is_borne: whether the upper side bears such things. Others may be at any height.
    """

    opposite: str
    preposition: str
    adverb: str
    part: str
    is_inside: bool = False
    is_borne: bool = False


# By the name of an edge from the thing to the furniture.
RELATION_TABLE = {
    "in": Relation("contains", "in", "inside", "inside", is_inside=True),
    "onTop": Relation("under", "on", "on top", "upper side", is_borne=True),
}
RELATIONS = tuple(RELATION_TABLE)  # by number
NUM_RELATIONS = len(RELATIONS)
INSIDE, ON_TOP = map(RELATIONS.index, ("in", "onTop"))
USUAL_RELATION = "onTop"  # where nothing is said or known
IS_INSIDE, IS_BORNE = (
    np.array([getattr(relation, name) for relation in RELATION_TABLE.values()], dtype=bool)  # (R,)
    for name in ("is_inside", "is_borne")
)
OPPOSITES = {name: relation.opposite for name, relation in RELATION_TABLE.items()}
# What an edge says of its two nodes, in either direction.
EDGE_RELATIONS = tuple(name for pair in OPPOSITES.items() for name in pair)
QUERY_EDGE_TYPES = tuple(("object", relation, "furniture") for relation in RELATIONS)
_FROM_FURNITURE = tuple(("furniture", opposite, "object") for opposite in OPPOSITES.values())
LAYOUT_EDGE_TYPES = tuple(
    etype
    for child, parent in LAYOUT_PAIRS
    for etype in ((parent, "contains", child), (child, "in", parent))
)
EDGE_TYPES = (  # those of looks come last, and query edge types lie one after the other
    *LAYOUT_EDGE_TYPES,
    *_FROM_FURNITURE[:1],
    *QUERY_EDGE_TYPES,
    *_FROM_FURNITURE[1:],
)
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


NUM_LOOKS_KEPT = 8  # of every place; what older ones said has been overtaken by moves
NEVER = -1  # time stamp of what has not happened
NOW = -2.0  # as an upper bound: the time step of the memory

Columns = Mapping[str, np.ndarray]  # of one table, by name


@dataclass(frozen=True, slots=True)
class Merge:
    """How the value of rows that become one is made of theirs.

    Furniture that is one was looked at as two: its looks add up. Nodes that are one thing were held
    against the same looks, each under its own name (`sgm.memory.merged_things`).

    Attributes:
        how: "own" of the row that stays; "sum", "max" or "min"; "first" for the least that is not
            `NEVER`; "newest" for that of the row whose `columns` are the highest, compared in
            turn, of equal ones the last; "known" for the newest that is not the default; "mean" of
            all, weighted by that of `columns`.
        columns: names of columns.
        same_looks: how it is for edges of nodes that are one; empty for the same.
        most: name of a column declared before, which it is no more than.
    """

    how: str
    columns: tuple[str, ...] = ()
    same_looks: str = ""
    most: str = ""


OWN, SUM, MAX, FIRST = Merge("own"), Merge("sum"), Merge("max"), Merge("first")
LOOKS = Merge("sum", same_looks="max")  # what looks count
MERGE_RULES = ("own", "sum", "max", "min", "first", "newest", "known", "mean")
# What a thing has that is split off another: its own; that of the other, too; one of several; or
# what is merged of a column of its edges, by the name of that.
SPLIT_RULES = ("own", "both", "one")


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        name: within its table.
        text: what it holds, in a line for people.
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
        merges: what it is of rows that become one; every column of a home's tables says that.
        splits: what it is of a thing that is split off another (`SPLIT_RULES`), or a column of its
            edges; every column of objects says that.
    """

    name: str
    text: str = field(default="", kw_only=True)
    dtype: type = np.int32
    default: float = 0
    low: float = 0
    high: float = MAX_TIME
    refers_to: str = ""
    guess: Callable[[Columns, Columns], np.ndarray] | None = None
    is_counter: bool = False
    is_fixed: bool = False
    is_derived: bool = False
    merges: Merge | None = None
    splits: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether its numbers are whole."""
        return not np.issubdtype(self.dtype, np.floating)

    def make_guess(self, columns: Columns, objects: Columns, num_rows: int) -> np.ndarray:
        """Return what stands for it where a file does not have it, (num_rows,)."""
        if self.guess is not None:
            return self.guess(columns, objects)
        return np.full(num_rows, self.default, dtype=np.int64 if self.is_whole else float)


_count = partial(Column, is_counter=True)
_fixed = partial(Column, is_fixed=True)
_stamp = partial(Column, default=NEVER, low=NEVER, high=NOW)  # a time step, `NEVER` at first


def _guess_first_observed(columns: Columns, objects: Columns) -> np.ndarray:
    """The start stands for the first of several sightings."""
    return np.where(columns["num_observed"] < 2, columns["last_observed"], 0)


def _guess_true(columns: Columns, objects: Columns) -> np.ndarray:
    """An edge is true if the last look found it so."""
    is_last = columns["last_observed"] == columns["last_true"]
    return ((columns["num_true"] > 0) & is_last).astype(np.int64)


def _guess_time_true(columns: Columns, objects: Columns) -> np.ndarray:
    """It was true for that share of the time since the first sighting at which looks found it."""
    known = columns["last_observed"] - objects["first_observed"][columns["object"]]
    share = known * columns["num_true"] // np.maximum(columns["num_observed"], 1)
    return np.where(columns["num_true"], share, 0)


def _guess_absent(columns: Columns, objects: Columns) -> np.ndarray:
    """All looks that did not show it came after those that did."""
    return np.where(columns["is_true"], 0, columns["num_observed"] - columns["num_true"])


FURNITURE = (
    _count("num_observed", text="looks at it", merges=SUM),
    _stamp(
        "last_observed",
        text="step of the last look at it, -1 for never",
        is_counter=True,
        merges=MAX,
    ),
)
_LAST_SEEN = Merge("newest", columns=("last_observed",))
OBJECTS = (
    Column("home", text="number of its home", is_derived=True, merges=OWN, splits="own"),
    _fixed("key", text="number of its description", is_derived=True, merges=OWN, splits="own"),
    _fixed(
        "label",
        text="label that it is of",
        refers_to="labels",
        is_derived=True,
        merges=OWN,
        splits="own",
    ),
    Column(
        "type",
        text="object type of the prior, -1 for none",
        low=-1,
        is_derived=True,
        merges=OWN,
        splits="own",
    ),
    _count("num_observed", text="looks that saw it", merges=SUM, splits="num_true"),
    _stamp(
        "last_observed",
        text="step of the last sighting",
        is_counter=True,
        merges=MAX,
        splits="last_true",
    ),
    _count(
        "num_moved",
        text="how often it was seen at another place than before",
        merges=SUM,
        splits="own",
    ),
    _stamp(
        "last_moved",
        text="step of the last of these sightings",
        is_counter=True,
        merges=MAX,
        splits="own",
    ),
    Column(
        "last_furniture",
        text="furniture where it was seen last, -1 for none",
        default=NEVER,
        low=NEVER,
        refers_to="furniture",
        merges=_LAST_SEEN,
        splits="furniture",
    ),
    _stamp(
        "first_observed",
        text="step of the first sighting",
        guess=_guess_first_observed,
        merges=FIRST,
        splits="both",
    ),
    Column(
        "num_at_once",
        text="most of this description that a robot saw in one look or step; 0 in simulated homes",
        guess=lambda columns, _: np.minimum(columns["num_observed"], 1),
        merges=MAX,
        splits="one",
    ),
    Column(
        "num_sought",
        text="looks where it was seen last, while it was asked for",
        merges=SUM,
        splits="own",
    ),
    Column(
        "num_still",
        text="how many of these found it; both are 0 without a history",
        merges=SUM,
        splits="own",
    ),
    _stamp(
        "carried_since",
        text="step since which the robot carries it, -1 if it does not",
        merges=MAX,
        splits="own",
    ),
    Column(
        "same_as",
        text="object that it was merged with, -1 for none",
        default=-1,
        low=-1,
        refers_to="objects",
        merges=OWN,
        splits="own",
    ),
)
_BY_LOOK = ("last_observed", "last_true")
_SINCE = Merge("newest", columns=_BY_LOOK, same_looks="min")  # of looks since it was last true
EDGES = (
    Column("home", text="number of its home", is_derived=True, merges=OWN),
    _fixed("object", text="the thing", refers_to="objects", merges=OWN),
    _fixed("furniture", text="where it was seen or missed", refers_to="furniture", merges=OWN),
    _fixed(
        "relation", text='0 "in" the furniture, 1 "onTop" of it', high=NUM_RELATIONS - 1, merges=OWN
    ),
    _fixed("prior", np.float32, text="weight of the prior", is_derived=True, merges=OWN),
    _count("num_observed", text="looks that showed it or missed it", merges=LOOKS),
    _count("num_true", text="looks that showed it", merges=Merge("sum", most="num_observed")),
    _count("num_changed", text="changes between the two", merges=LOOKS),
    _stamp("last_observed", text="step of the last look", is_counter=True, merges=MAX),
    _stamp("last_changed", text="step of the last change", is_counter=True, merges=MAX),
    _stamp("last_true", text="step of the last sighting", is_counter=True, merges=MAX),
    _count(
        "is_true",
        text="whether the last look showed it",
        dtype=np.bool_,
        high=1,
        guess=_guess_true,
        merges=Merge("newest", columns=_BY_LOOK, same_looks="max"),
    ),
    Column(
        "num_absent",
        text="looks since the last sighting, all of them if there was none",
        guess=_guess_absent,
        merges=_SINCE,
    ),
    Column(
        "time_true",
        text="steps from looks that showed it to the next look each",
        guess=_guess_time_true,
        merges=LOOKS,
    ),
    Column(  # as guessed if all looks were whole ones
        "missed",
        np.float32,
        text="looks since the last sighting, partial ones in part",
        guess=lambda columns, _: columns["num_absent"].astype(float),
        merges=_SINCE,
    ),
    Column(  # as guessed if all sightings were sure
        "confidence",
        np.float32,
        text="confidence of the last sighting, 0 without one",
        high=1,
        guess=lambda columns, _: (columns["num_true"] > 0).astype(float),
        merges=Merge("newest", columns=("last_true", "confidence")),
    ),
    Column(
        "came_from",
        text="other furniture at which it was seen before it came here last, -1 for none",
        default=NEVER,
        low=NEVER,
        refers_to="furniture",
        merges=Merge("known", columns=("last_true",)),
    ),
)
_LAST_SPOT, _USUAL_SPOT = Merge("newest", columns=("time",)), Merge("mean", columns=("num_seen",))
_metres = partial(Column, dtype=np.float64, low=-MOST_METRES, high=MOST_METRES)
# Where things were seen, in the frame of the map.
POSITIONS = (
    Column("object", text="the thing", refers_to="objects", merges=OWN),
    Column(
        "furniture", text="where it was seen with a position", refers_to="furniture", merges=OWN
    ),
    Column("relation", text="as of edges", high=NUM_RELATIONS - 1, merges=OWN),
    _stamp(
        "time",
        text="step of the last position, -1 since the thing was said to be moved",
        merges=MAX,
    ),
    Column("num_seen", text="how many positions there were", default=1, low=1, merges=SUM),
    *(
        _metres(name, text=f"{name} of the last position, metres in the map", merges=_LAST_SPOT)
        for name in ("x", "y", "z")
    ),
    Column(
        "sd",
        np.float64,
        text="standard deviation of the last position, metres, -1 for unknown",
        default=-1,
        low=-1,
        high=MOST_METRES,
        merges=_LAST_SPOT,
    ),
    *(
        _metres(
            f"usual_{name}", text=f"{name} of a robust mean of all positions", merges=_USUAL_SPOT
        )
        for name in ("x", "y", "z")
    ),
)
# Looks for one thing alone that did not find it; of one thing at one place no more than
# `NUM_LOOKS_KEPT` rows.
LONE_LOOKS = (
    Column("object", text="the thing", refers_to="objects", merges=OWN),
    Column("place", text="furniture that was looked at", refers_to="furniture", merges=OWN),
    _stamp("time", text="step of the look, the last one of several", merges=OWN),
    Column("num_looks", np.float64, text="looks, partial ones in part", merges=OWN),
)
# One row for each home, which is never merged.
HOME = tuple(
    Column(name, np.float64, text=text, high=np.inf, merges=OWN)
    for name, text in (
        ("num_asked", "questions asked"),
        ("num_found", "sightings of what was asked for"),
        ("num_last_right", "of these, where the thing was seen last"),
        ("num_common_right", "of these, where it was seen the most often per look"),
        ("num_prior_right", "of these, at the prior's first choice"),
        ("num_moved", "sightings that found a thing moved"),
        ("time_followed", "steps between the sightings of all things"),
        ("num_missed", "looks that missed a thing which was found there again, discounted"),
        ("num_refound", "looks that found it there again, discounted"),
    )
)
TABLES = {  # of a home, by name
    "furniture": FURNITURE,
    "objects": OBJECTS,
    "edges": EDGES,
    "positions": POSITIONS,
    "lone_looks": LONE_LOOKS,
}


def check_columns(tables: Mapping[str, tuple[Column, ...]]) -> None:
    """Check that all columns say what they hold, and how they merge and split.

    Raises:
        ValueError: if a column does not.
    """
    for table, columns in tables.items():
        for number, column in enumerate(columns):
            rule, before = column.merges, [other.name for other in columns[:number]]
            names = [other.name for other in columns]
            splits = (*SPLIT_RULES, *(other.name for other in EDGES))
            if not column.text:
                _refuse(table, column, "have a text", column.text, "Say in a line what it holds")
            if rule is None or {rule.how, rule.same_looks or "own"} - {*MERGE_RULES}:
                _refuse(table, column, "say how it merges", rule, "Give merges, such as SUM or OWN")
            elif {*rule.columns} - {*names} or (rule.most and rule.most not in before):
                _refuse(table, column, "merge by columns of its table", rule, "Check their names")
            if table == "objects" and column.splits not in splits:
                _refuse(table, column, "say how it splits", column.splits, 'Give splits, as "own"')


def _refuse(table: str, column: Column, rule: str, value: object, remedy: str) -> None:
    raise ValueError(
        f"column {column.name} of {table} must {rule}, got {value!r}. {remedy} (sgm/schema.py)."
    )


check_columns({**TABLES, "home": HOME})

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

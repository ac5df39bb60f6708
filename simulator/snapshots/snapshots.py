"""Snapshots: scene graph memories at the moment of a query, as tables of flat columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.arrays.grouped import compute_starts
from sgm.arrays.week import compute_week_seconds
from sgm.schema import NEVER, NODE_TABLE, SNAPSHOT_TABLES, Columns


@dataclass(frozen=True, slots=True)
class Snapshots:
    """B scene graph memories, each with its query object; counters and time stamps are raw.

    The tables have the columns of `SNAPSHOT_TABLES`, most of which are those of the memory, and
    `snapshot`, the one that a row is of. Homes may differ in size: the rows of a table lie snapshot
    by snapshot, and name rows of other tables by their position among those of all snapshots.
    Only remembered edges are listed; hypothetical ones follow from `query_prior`. A snapshot's
    query edges are the edges of its query object. A time stamp of -1 means never.

    Attributes:
        labels: text of every label index.
        time: time step of each snapshot, (B,).
        clock: `MemoryBatch.clock` of the home of each snapshot, (B, 2); None if no home has one.
        rooms: `label`, (NR,).
        furniture: `label`, `room`, `prob`, P(furniture | room), and counters, (NF,).
        objects: `label`, `key`, the number of the description, and counters, (N,): what has an
            edge, and the query object.
        edges: `object`, `furniture`, `relation`, `prior`, the prior weight, and counters, (E,).
        query_object: row of the query object among the N, (B,).
        query_prior: prior weight of every place for the query object, (NF, relations).
        answers: furniture that truly holds the query object, bool (NF,); None if unknown.
        extras: what else was kept of each furniture node for the query, float (NF,) or (NF, D) by
            name: "belief" (NF, 4), from `HomeFilter.compute_features`; "relevance" (NF,), how
            relevant the place is, where the task says; or whatever a filter or task gives.
        question_extras: what else was kept of each question, float (B, D) by name.
        more_nodes: tables of further types of `NODE_TABLE`, such as bags or boxes, by name of the
            table; without one there are none of that type.
    """

    labels: tuple[str, ...]
    time: np.ndarray
    rooms: Columns
    furniture: Columns
    objects: Columns
    edges: Columns
    query_object: np.ndarray
    query_prior: np.ndarray
    answers: np.ndarray | None = None
    extras: Mapping[str, np.ndarray] = field(default_factory=dict)
    question_extras: Mapping[str, np.ndarray] = field(default_factory=dict)
    clock: np.ndarray | None = None
    more_nodes: Mapping[str, Columns] = field(default_factory=dict)

    @property
    def num_snapshots(self) -> int:
        """Number of snapshots, B."""
        return len(self.time)

    @property
    def questions(self) -> Columns:
        """The questions as a table of one row a snapshot: `object` is the query object."""
        return {"snapshot": np.arange(self.num_snapshots), "object": self.query_object}

    def get_nodes(self, node_type: str) -> Columns:
        """Return `label`, `snapshot` and all other columns of the nodes of a type."""
        table = NODE_TABLE[node_type].table
        if not table:
            snapshot = np.arange(self.num_snapshots)
            label = self.labels.index(node_type)
            return {"snapshot": snapshot, "label": np.full(len(snapshot), label)}
        none = np.zeros(0, dtype=np.int64)
        tables = {"rooms": self.rooms, "furniture": self.furniture, "objects": self.objects}
        return {**tables, **self.more_nodes}.get(table, {"snapshot": none, "label": none})

    def list_held(self, child: str, parent: str) -> tuple[np.ndarray, np.ndarray]:
        """List the rows of nodes of a type that are in nodes of another, and of these, (n,) each.

        The two types are one of `LAYOUT_PAIRS`.
        """
        nodes = self.get_nodes(child)
        none = np.full(len(nodes["label"]), NEVER)
        is_single = not NODE_TABLE[parent].table  # one of each snapshot
        held = nodes["snapshot"] if is_single else nodes.get(parent, none)
        rows = np.flatnonzero(held != NEVER)
        return rows, held[rows]

    def find_first(self, table: str) -> np.ndarray:
        """Return the first row of each snapshot in a table and, last, their number, (B + 1,)."""
        rows = getattr(self, table)["snapshot"]
        return compute_starts(np.bincount(rows, minlength=self.num_snapshots))

    def select(self, table: str, rows: np.ndarray, **columns: np.ndarray) -> Selection:
        """Select rows of a table, (n,), with columns that it has not, or not of rows of -1."""
        return Selection(self, table, rows, columns)


class Selection(dict[str, np.ndarray]):
    """Some rows of a table of snapshots: its columns by name, each taken when it is first read.

    Beside those there is `time`, the present time step of each. A row of -1 is none of the table,
    but a hypothetical edge: it has what it was selected with, and the counters of an edge that was
    never observed.

    Attributes:
        snapshots: the snapshots.
        table: "rooms", "furniture", "objects", "edges" or "questions".
        rows: which of its rows, (n,).
    """

    def __init__(
        self, snapshots: Snapshots, table: str, rows: np.ndarray, columns: Columns
    ) -> None:
        """Select rows, of which some columns are known."""
        super().__init__(columns)
        self.snapshots, self.table, self.rows = snapshots, table, rows

    def __missing__(self, name: str) -> np.ndarray:
        if name == "time":
            found = self.snapshots.time[self["snapshot"]]
        else:
            column = getattr(self.snapshots, self.table)[name]
            if self.table == "edges":
                column = np.append(column, column.dtype.type(_NEW_EDGE[name]))  # -1 is the last
            found = column[self.rows]
        self[name] = found
        return found

    def select(self, chosen: np.ndarray) -> Selection:
        """Select some of these rows."""
        known = {name: column[chosen] for name, column in self.items()}
        return Selection(self.snapshots, self.table, self.rows[chosen], known)

    def since(self, name: str) -> np.ndarray:
        """Return the steps since a time stamp; since the start for what has never happened."""
        return np.where(self[name] == NEVER, self["time"], self["time"] - self[name])

    def extra(self, name: str) -> np.ndarray:
        """Return what else was kept of questions, or of the places of edges, (n, ...).

        Raises:
            ValueError: if nothing was.
        """
        is_question = self.table == "questions"
        extras = self.snapshots.question_extras if is_question else self.snapshots.extras
        if name not in extras:
            raise ValueError(
                f"snapshots must hold {name} for `features.{name}`, got none. Collect with "
                f"`--{name} true`, or switch the feature off."
            )
        return extras[name][self["furniture"] if self.table == "edges" else self.rows]


_NEW_EDGE = {column.name: column.default for column in SNAPSHOT_TABLES["edges"]}


def make_counters(table: str, count: int) -> dict[str, np.ndarray]:
    """Return counters of rows of which nothing was observed, (count,), by name."""
    return {
        column.name: np.full(count, column.default, dtype=column.dtype)
        for column in SNAPSHOT_TABLES[table]
        if column.is_counter
    }


def forget(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that have not seen anything yet and are asked the same.

    The layout and the query objects are left; there is no remembered edge, no counter, no node of
    `more_nodes`, and time starts now: what the clock shows is no memory.
    """
    batch, clock, asked = snapshots.num_snapshots, snapshots.clock, snapshots.query_object
    known = {column.name for column in SNAPSHOT_TABLES["objects"]} | {"snapshot"}
    if clock is not None:
        now = compute_week_seconds(clock, snapshots.time)
        clock = np.stack([now, clock[:, 1]], axis=1)
    num_furniture = len(snapshots.query_prior)
    return replace(
        snapshots,
        time=np.zeros(batch, dtype=np.int32),
        clock=clock,
        furniture={**snapshots.furniture, **make_counters("furniture", num_furniture)},
        objects={
            **{name: column[asked] for name, column in snapshots.objects.items() if name in known},
            **make_counters("objects", batch),
        },
        edges={name: column[:0] for name, column in snapshots.edges.items()},
        query_object=np.arange(batch),
        more_nodes={},
    )


def forget_absence(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that note where things were seen, never where they were not.

    Edges that were never seen true are left out. Of the others only sightings are counted: observed
    as often as seen, last observed when last seen, never changed.
    """
    was_true = snapshots.edges["num_true"] > 0
    seen = {name: column[was_true] for name, column in snapshots.edges.items()}
    sightings = make_counters("edges", len(seen["num_true"]))
    sightings["num_observed"] = sightings["num_true"] = seen["num_true"]
    sightings["last_observed"] = sightings["last_true"] = seen["last_true"]
    sightings["is_true"][:] = True
    return replace(snapshots, edges=seen | sightings)

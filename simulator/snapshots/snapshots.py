"""Snapshots: scene graph memories at the moment of a query, as tables of flat columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.arrays.grouped import compute_starts
from sgm.arrays.week import compute_week_seconds
from sgm.schema import SNAPSHOT_TABLES, Columns


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
        query_prior: prior weight of every place for the query object, (NF, 2).
        answers: furniture that truly holds the query object, bool (NF,); None if unknown.
        extras: what else was kept of each furniture node for the query, float (NF,) or (NF, D) by
            name: "belief" (NF, 4), from `HomeFilter.compute_features`; "relevance" (NF,), how
            relevant the place is, where the task says; or whatever a filter or task gives.
        question_extras: what else was kept of each question, float (B, D) by name.
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

    @property
    def num_snapshots(self) -> int:
        """Number of snapshots, B."""
        return len(self.time)

    @property
    def tables(self) -> dict[str, Columns]:
        """The tables by the names of their declarations (`SNAPSHOT_TABLES`)."""
        return {table: getattr(self, table) for table in SNAPSHOT_TABLES}

    def find_first(self, table: str) -> np.ndarray:
        """Return the first row of each snapshot in a table and, last, their number, (B + 1,)."""
        rows = self.tables[table]["snapshot"]
        return compute_starts(np.bincount(rows, minlength=self.num_snapshots))


def make_counters(table: str, count: int) -> dict[str, np.ndarray]:
    """Return counters of rows of which nothing was observed, (count,), by name."""
    return {
        column.name: np.full(count, column.default, dtype=column.dtype)
        for column in SNAPSHOT_TABLES[table]
        if column.is_counter
    }


def forget(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that have not seen anything yet and are asked the same.

    The layout and the query objects are left; there is no remembered edge, no counter, and time
    starts now: what the clock shows is no memory.
    """
    batch, clock, asked = snapshots.num_snapshots, snapshots.clock, snapshots.query_object
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
            **{name: column[asked] for name, column in snapshots.objects.items()},
            **make_counters("objects", batch),
        },
        edges={name: column[:0] for name, column in snapshots.edges.items()},
        query_object=np.arange(batch),
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

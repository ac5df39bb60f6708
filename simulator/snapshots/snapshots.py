"""Snapshots: scene graph memories at the moment of a query, as flat arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.arrays.week import compute_week_seconds
from sgm.schema import EDGE_COUNTERS, FURNITURE_COUNTERS, NEVER, OBJECT_COUNTERS

# Counters and time stamps by name, as `sgm.schema` declares them.
Counters = Mapping[str, np.ndarray]


@dataclass(frozen=True, slots=True)
class Snapshots:
    """B scene graph memories, each with its query object; counters and time stamps are raw.

    Homes may differ in size: the rooms of all snapshots lie in one row of NR, their furniture in
    one of NF, their objects in one of N and their edges in one of E, each snapshot by snapshot.
    Only remembered edges are listed; hypothetical ones follow from `query_prior`. A snapshot's
    query edges are the edges of its query object. A time stamp of -1 means never.

    Attributes:
        labels: text of every label index.
        time: time step of each snapshot, (B,).
        first_room, first_furniture: first row of each snapshot and, last, NR or NF, (B + 1,).
        room_label: (NR,).
        furniture_label, furniture_prob: label and P(furniture | room), (NF,).
        furniture_room: row of the room among the NR, (NF,).
        furniture_counters: columns of `FURNITURE_COUNTERS` by name, (NF,).
        object_snapshot: the snapshot that each object node belongs to, ascending, (N,).
        object_label: (N,).
        object_counters: columns of `OBJECT_COUNTERS` by name, (N,).
        edge_object: row of the object node among the N, (E,); their snapshots ascend.
        edge_furniture: row of the furniture node among the NF, (E,).
        edge_relation: 0 "in", 1 "onTop", (E,).
        edge_prior: prior weight, (E,).
        edge_counters: columns of `EDGE_COUNTERS` by name, (E,).
        query_object: row of the query object among the N, (B,).
        query_prior: prior weight of every place for the query object, (NF, 2).
        answers: furniture that truly holds the query object, bool (NF,); None if unknown.
        extras: what else was kept of each furniture node for the query, float (NF,) or (NF, D) by
            name: "belief" (NF, 4), from `HomeFilter.compute_features`; "relevance" (NF,), how
            relevant the place is, where the task says; or whatever a filter or task gives.
        question_extras: what else was kept of each question, float (B, D) by name.
        clock: `MemoryBatch.clock` of the home of each snapshot, (B, 2); None if no home has one.
    """

    labels: tuple[str, ...]
    time: np.ndarray
    first_room: np.ndarray
    first_furniture: np.ndarray
    room_label: np.ndarray
    furniture_label: np.ndarray
    furniture_room: np.ndarray
    furniture_prob: np.ndarray
    furniture_counters: Counters
    object_snapshot: np.ndarray
    object_label: np.ndarray
    object_counters: Counters
    edge_object: np.ndarray
    edge_furniture: np.ndarray
    edge_relation: np.ndarray
    edge_prior: np.ndarray
    edge_counters: Counters
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
    def room_snapshot(self) -> np.ndarray:
        """The snapshot that each room belongs to, (NR,)."""
        return np.repeat(np.arange(self.num_snapshots), np.diff(self.first_room))

    @property
    def furniture_snapshot(self) -> np.ndarray:
        """The snapshot that each furniture node belongs to, (NF,)."""
        return np.repeat(np.arange(self.num_snapshots), np.diff(self.first_furniture))


def make_counters(names: Sequence[str], count: int) -> dict[str, np.ndarray]:
    """Return counters of nodes or edges that were never seen, int32 (count,), by name."""
    return {
        name: np.full(count, NEVER if name.startswith("last") else 0, dtype=np.int32)
        for name in names
    }


def forget(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that have not seen anything yet and are asked the same.

    The layout and the query objects are left; there is no remembered edge, no counter, and time
    starts now: what the clock shows is no memory.
    """
    batch, clock = snapshots.num_snapshots, snapshots.clock
    if clock is not None:
        now = compute_week_seconds(clock, snapshots.time)
        clock = np.stack([now, clock[:, 1]], axis=1)
    no_edges = np.zeros(0, dtype=np.int32)
    return replace(
        snapshots,
        time=np.zeros(batch, dtype=np.int32),
        clock=clock,
        object_snapshot=np.arange(batch),
        object_label=snapshots.object_label[snapshots.query_object],
        query_object=np.arange(batch),
        edge_object=no_edges,
        edge_furniture=no_edges,
        edge_relation=no_edges,
        edge_prior=np.zeros(0, dtype=np.float32),
        furniture_counters=make_counters(FURNITURE_COUNTERS, len(snapshots.furniture_label)),
        object_counters=make_counters(OBJECT_COUNTERS, batch),
        edge_counters=make_counters(EDGE_COUNTERS, 0),
    )


def forget_absence(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that note where things were seen, never where they were not.

    Edges that were never seen true are left out. Of the others only sightings are counted: observed
    as often as seen, last observed when last seen, never changed.
    """
    counters = snapshots.edge_counters
    was_true = counters["num_true"] > 0
    num_true, last_true = counters["num_true"][was_true], counters["last_true"][was_true]
    return replace(
        snapshots,
        edge_object=snapshots.edge_object[was_true],
        edge_furniture=snapshots.edge_furniture[was_true],
        edge_relation=snapshots.edge_relation[was_true],
        edge_prior=snapshots.edge_prior[was_true],
        edge_counters={
            "num_observed": num_true,
            "num_true": num_true,
            "num_changed": np.zeros_like(num_true),
            "last_observed": last_true,
            "last_changed": np.full_like(last_true, NEVER),
            "last_true": last_true,
            "is_true": np.ones_like(counters["is_true"][was_true]),
        },
    )

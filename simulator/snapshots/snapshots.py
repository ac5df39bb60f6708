"""Snapshots: scene graph memories at the moment of a query, as flat arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simulator.arrays.grouped import concatenate_ranges, number_keys
from simulator.memory.clock import compute_week_seconds
from simulator.memory.memory_batch import (
    EDGE_COUNTERS,
    NEVER,
    OBJECT_COUNTERS,
    MemoryBatch,
    Queries,
)


@dataclass(frozen=True, slots=True)
class Snapshots:
    """B scene graph memories, each with its query object; counters and time stamps are raw.

    Only remembered edges are listed; hypothetical ones follow from `query_prior`. A snapshot's
    query edges are the edges of its query object. A time stamp of -1 means never.

    Attributes:
        labels: text of every label index.
        time: time step of each snapshot, (B,).
        room_label: (B, R).
        furniture_label, furniture_room, furniture_prob: label, room index and P(furniture |
            room) of the furniture nodes, (B, F).
        furniture_num_observed, furniture_last_observed: looks so far, the last one, (B, F).
        object_snapshot: the snapshot that each object node belongs to, (N,).
        object_label, object_num_observed, object_last_observed, object_num_moved,
            object_last_moved: (N,).
        edge_object: index of the object node among the N, (E,).
        edge_furniture: furniture index within the snapshot, (E,).
        edge_relation: 0 "in", 1 "onTop", (E,).
        edge_prior: prior weight, (E,).
        edge_num_observed, edge_num_true, edge_num_changed, edge_last_observed,
            edge_last_changed, edge_last_true, edge_is_true: (E,).
        query_object: index of the query object among the N, (B,).
        query_prior: prior weight of every place for the query object, (B, F, 2).
        answers: furniture that truly holds the query object, bool (B, F); None if unknown.
        query_belief: what `HomeFilter` believes about the query object at every place, the columns
            of `HomeBelief.stack`, (B, F, 4); None where it was not asked.
        query_grades: what each place is worth, where the task grades places, (B, F); else None.
        clock: `MemoryBatch.clock` of the home of each snapshot, (B, 2); None if no home has one.
    """

    labels: tuple[str, ...]
    time: np.ndarray
    room_label: np.ndarray
    furniture_label: np.ndarray
    furniture_room: np.ndarray
    furniture_prob: np.ndarray
    furniture_num_observed: np.ndarray
    furniture_last_observed: np.ndarray
    object_snapshot: np.ndarray
    object_label: np.ndarray
    object_num_observed: np.ndarray
    object_last_observed: np.ndarray
    object_num_moved: np.ndarray
    object_last_moved: np.ndarray
    edge_object: np.ndarray
    edge_furniture: np.ndarray
    edge_relation: np.ndarray
    edge_prior: np.ndarray
    edge_num_observed: np.ndarray
    edge_num_true: np.ndarray
    edge_num_changed: np.ndarray
    edge_last_observed: np.ndarray
    edge_last_changed: np.ndarray
    edge_last_true: np.ndarray
    edge_is_true: np.ndarray
    query_object: np.ndarray
    query_prior: np.ndarray
    answers: np.ndarray | None = None
    query_belief: np.ndarray | None = None
    query_grades: np.ndarray | None = None
    clock: np.ndarray | None = None

    @property
    def num_snapshots(self) -> int:
        """Number of snapshots, B."""
        return len(self.time)

    @property
    def num_furniture(self) -> int:
        """Furniture nodes per snapshot, F."""
        return self.furniture_label.shape[1]


def take_snapshots(memory: MemoryBatch, queries: Queries) -> Snapshots:
    """Take one snapshot per query, (Q,) snapshots of the homes that are asked.

    Source: paper section 4.2; docs/design.md, ruling 12.
    """
    objects, edges = memory.objects, memory.edges
    edge_order = np.argsort(edges["home"], kind="stable")
    edge_counts = np.bincount(edges["home"], minlength=memory.num_homes)
    edge_starts = np.cumsum(edge_counts) - edge_counts
    edge = edge_order[concatenate_ranges(edge_starts[queries.home], edge_counts[queries.home])]
    edge_snapshot = np.repeat(np.arange(len(queries.home)), edge_counts[queries.home])
    # Nodes: whatever has an edge, and the query object. One key per (snapshot, object).
    num_objects = len(objects)
    edge_key = edge_snapshot * num_objects + edges["object"][edge]
    query_key = np.arange(len(queries.home)) * num_objects + queries.object
    size = len(queries.home) * num_objects
    node_keys, node_of_key = number_keys(size, edge_key, query_key)
    snapshot, row = np.divmod(node_keys, num_objects)
    home = queries.home
    return Snapshots(
        labels=tuple(memory.labels),
        time=np.full(len(home), memory.time),
        room_label=memory.room_label[home],
        furniture_label=memory.furniture_label[home],
        furniture_room=memory.furniture_room[home],
        furniture_prob=memory.place_prior.furniture_prob[home],
        furniture_num_observed=memory.furniture_num_observed[home],
        furniture_last_observed=memory.furniture_last_observed[home],
        object_snapshot=snapshot,
        object_label=objects["label"][row],
        edge_object=node_of_key[edge_key],
        edge_furniture=edges["furniture"][edge],
        edge_relation=edges["relation"][edge],
        edge_prior=edges["prior"][edge],
        query_object=node_of_key[query_key],
        query_prior=queries.prior,
        clock=None if memory.clock is None else memory.clock[home],
        **{f"object_{name}": objects[name][row] for name in OBJECT_COUNTERS},
        **{f"edge_{name}": edges[name][edge] for name in EDGE_COUNTERS},
    )


def forget(snapshots: Snapshots) -> Snapshots:
    """Return the snapshots of agents that have not seen anything yet and are asked the same.

    The layout and the query objects are left; there is no remembered edge, no counter, and time
    starts now: what the clock shows is no memory.
    """
    batch = snapshots.num_snapshots
    none, never = np.zeros(batch, dtype=np.int32), np.full(batch, NEVER, dtype=np.int32)
    clock = snapshots.clock
    if clock is not None:
        now = compute_week_seconds(clock, snapshots.time)
        clock = np.stack([now, clock[:, 1]], axis=1)
    shape = snapshots.furniture_label.shape
    no_edges = np.zeros(0, dtype=np.int32)
    counters: dict[str, Any] = {f"edge_{name}": no_edges for name in EDGE_COUNTERS}
    for name in OBJECT_COUNTERS:
        counters[f"object_{name}"] = never if name.startswith("last") else none
    return replace(
        snapshots,
        time=none,
        clock=clock,
        furniture_num_observed=np.zeros(shape, dtype=np.int32),
        furniture_last_observed=np.full(shape, NEVER, dtype=np.int32),
        object_snapshot=np.arange(batch),
        object_label=snapshots.object_label[snapshots.query_object],
        query_object=np.arange(batch),
        edge_object=no_edges,
        edge_furniture=no_edges,
        edge_relation=no_edges,
        edge_prior=np.zeros(0, dtype=np.float32),
        **counters,
    )

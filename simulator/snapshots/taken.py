"""Snapshots of memories that are in use, one for each query."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.arrays.grouped import compute_starts, join_groups, number_keys
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.schema import EDGE_COUNTERS, FURNITURE_COUNTERS, OBJECT_COUNTERS
from simulator.snapshots.snapshots import Snapshots


def take_snapshots(
    memory: MemoryBatch, queries: Queries, answers: np.ndarray | None = None,
    extras: Mapping[str, np.ndarray] | None = None,
    question_extras: Mapping[str, np.ndarray] | None = None, asked_alone: bool = False,
) -> Snapshots:  # fmt: skip
    """Take one snapshot per query, of the home that is asked; nothing of the padding is in it.

    Args:
        memory: the memories.
        queries: what is asked, (Q,).
        answers: furniture that truly holds the object asked for, bool (Q, F).
        extras: what else to keep of each furniture node, (Q, F) or (Q, F, D) by name.
        question_extras: what else to keep of each question, (Q, D) by name.
        asked_alone: whether the objects asked for and their edges are taken alone, for models that
            read no others.

    Source: paper section 4.2; docs/design.md, ruling 12.
    """
    objects, edges, home = memory.objects, memory.edges, queries.home
    is_furniture, room_label = memory.is_furniture[home], memory.room_label[home]
    is_room = room_label >= 0
    first_room = compute_starts(is_room.sum(axis=1))
    first_furniture = compute_starts(is_furniture.sum(axis=1))
    room_of_furniture = (memory.furniture_room[home] + first_room[:-1, None])[is_furniture]

    if asked_alone:
        edge_snapshot, edge = memory.edges_of(queries)
    else:
        edge_snapshot, edge = join_groups(home, edges["home"], memory.num_homes)
    order = np.argsort(edge_snapshot, kind="stable")
    edge_snapshot, edge = edge_snapshot[order], edge[order]
    # Nodes: whatever has an edge, and the query object. One key per (snapshot, object).
    num_objects = objects.num_rows
    edge_key = edge_snapshot * num_objects + edges["object"][edge]
    query_key = np.arange(len(home)) * num_objects + queries.object
    node_keys, node_of_key = number_keys(len(home) * num_objects, edge_key, query_key)
    snapshot, row = np.divmod(node_keys, num_objects)
    return Snapshots(
        labels=tuple(memory.labels),
        time=np.full(len(home), memory.time),
        first_room=first_room,
        first_furniture=first_furniture,
        room_label=room_label[is_room],
        furniture_label=memory.furniture_label[home][is_furniture],
        furniture_room=room_of_furniture,
        furniture_prob=memory.place_prior.furniture_prob[home][is_furniture],
        object_snapshot=snapshot,
        object_label=objects["label"][row],
        edge_object=node_of_key[edge_key],
        edge_furniture=edges["furniture"][edge] + first_furniture[edge_snapshot],
        edge_relation=edges["relation"][edge],
        edge_prior=edges["prior"][edge],
        query_object=node_of_key[query_key],
        query_prior=queries.prior[is_furniture],
        answers=None if answers is None else answers[is_furniture],
        extras={name: array[is_furniture] for name, array in (extras or {}).items()},
        question_extras=question_extras or {},
        clock=None if memory.clock is None else memory.clock[home],
        furniture_counters={
            name: memory.furniture[name][home][is_furniture] for name in FURNITURE_COUNTERS
        },
        object_counters={name: objects[name][row] for name in OBJECT_COUNTERS},
        edge_counters={name: edges[name][edge] for name in EDGE_COUNTERS},
    )

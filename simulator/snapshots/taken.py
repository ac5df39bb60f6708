"""Snapshots of memories that are in use, one for each query."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.arrays.grouped import compute_starts, join_groups, number_keys
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.schema import COUNTERS, SNAPSHOT_TABLES, Columns
from simulator.snapshots.snapshots import Snapshots


def take_snapshots(
    memory: MemoryBatch,
    queries: Queries,
    answers: np.ndarray | None = None,
    extras: Mapping[str, np.ndarray] | None = None,
    question_extras: Mapping[str, np.ndarray] | None = None,
    asked_alone: bool = False,
) -> Snapshots:
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
    home, objects = queries.home, memory.objects
    is_furniture, room_label = memory.is_furniture[home], memory.room_label[home]
    is_room = room_label >= 0
    first_room = compute_starts(is_room.sum(axis=1))
    first_furniture = compute_starts(is_furniture.sum(axis=1))
    layout = get_layout(memory)
    furniture = {name: column[home] for name, column in layout["furniture"].items()}
    furniture["room"] = furniture["room"] + first_room[:-1, None]
    furniture |= {name: memory.furniture[name][home] for name in COUNTERS["furniture"]}

    if asked_alone:
        edge_snapshot, edge = memory.edges_of(queries)
    else:
        edge_snapshot, edge = join_groups(home, memory.edges["home"], memory.num_homes)
    order = np.argsort(edge_snapshot, kind="stable")
    edge_snapshot, edge = edge_snapshot[order], edge[order]
    edges = {column.name: memory.edges[column.name][edge] for column in SNAPSHOT_TABLES["edges"]}
    # Nodes: whatever has an edge, and the query object. One key per (snapshot, object).
    num_objects = objects.num_rows
    edge_key = edge_snapshot * num_objects + edges["object"]
    query_key = np.arange(len(home)) * num_objects + queries.object
    node_keys, node_of_key = number_keys(len(home) * num_objects, edge_key, query_key)
    object_snapshot, thing = np.divmod(node_keys, num_objects)
    return Snapshots(
        labels=tuple(memory.labels),
        time=np.full(len(home), memory.time),
        clock=None if memory.clock is None else memory.clock[home],
        rooms={"snapshot": np.nonzero(is_room)[0], "label": room_label[is_room]},
        furniture={
            "snapshot": np.nonzero(is_furniture)[0],
            **{name: column[is_furniture] for name, column in furniture.items()},
        },
        objects={
            "snapshot": object_snapshot,
            **{column.name: objects[column.name][thing] for column in SNAPSHOT_TABLES["objects"]},
        },
        edges={
            **edges,
            "snapshot": edge_snapshot,
            "object": node_of_key[edge_key],
            "furniture": edges["furniture"] + first_furniture[edge_snapshot],
        },
        query_object=node_of_key[query_key],
        query_prior=queries.prior[is_furniture],
        answers=None if answers is None else answers[is_furniture],
        extras={name: array[is_furniture] for name, array in (extras or {}).items()},
        question_extras=question_extras or {},
    )


def get_layout(memory: MemoryBatch) -> dict[str, Columns]:
    """Return what is known of rooms, (H, R), and furniture, (H, F), without a look."""
    return {
        "rooms": {"label": memory.room_label},
        "furniture": {
            "label": memory.furniture_label,
            "room": memory.furniture_room,
            "prob": memory.place_prior.furniture_prob,
        },
    }

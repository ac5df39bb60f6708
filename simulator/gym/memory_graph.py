"""Scene graph memories as `gymnasium.spaces.Graph` observations."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box, Graph, GraphInstance

from simulator.memory.memory_batch import NEVER, MemoryBatch, Queries
from simulator.snapshots.snapshots import Snapshots, take_snapshots
from simulator.world.homes import NUM_RELATIONS

# kind: 0 home, 1 floor, 2 room, 3 furniture, 4 object. label: index into `labels`; description:
# its number, for objects. Steps since what never happened are -1, as is a description of what is
# no object.
NODE_FEATURES = (
    "kind", "label", "description", "num_observed", "steps_since_observed", "num_moved",
    "steps_since_moved", "is_query",
)  # fmt: skip
# relation: 0 contains, 1 in, 2 onTop. An edge that is not remembered is a hypothetical edge of the
# query object: the prior deems it possible. Edges lead from what holds to what is held.
EDGE_FEATURES = (
    "relation", "is_remembered", "num_observed", "num_true", "num_changed",
    "steps_since_observed", "steps_since_changed", "is_true", "prior",
)  # fmt: skip
_ROOM, _FURNITURE, _OBJECT = 2, 3, 4
_COLUMN = {name: column for column, name in enumerate(EDGE_FEATURES)}


def make_graph_space() -> Graph:
    """Return the space of the graphs: float32 features per node (8,) and per edge (9,)."""
    return Graph(
        node_space=Box(-1, np.inf, (len(NODE_FEATURES),), np.float32),
        edge_space=Box(-1, np.inf, (len(EDGE_FEATURES),), np.float32),
    )


def make_graphs(memory: MemoryBatch, queries: Queries) -> list[GraphInstance]:
    """Turn the memory of each query's home into a graph.

    Nodes come in this order: house, floor, R rooms, F furniture nodes (so that furniture f is node
    2 + R + f), then the objects that were ever seen or are asked for.

    Args:
        memory: the memories.
        queries: what is asked, one query per graph, (Q,).
    """
    snapshots = take_snapshots(memory, queries)
    first_object = 2 + snapshots.room_label.shape[1] + snapshots.num_furniture
    object_count = np.bincount(snapshots.object_snapshot, minlength=snapshots.num_snapshots)
    object_start = np.cumsum(object_count) - object_count
    row = np.arange(len(snapshots.object_snapshot)) - object_start[snapshots.object_snapshot]
    layout = _make_layout_nodes(snapshots)
    objects = _make_object_nodes(memory, queries, snapshots)
    layout_links, layout_edges = _make_layout_edges(snapshots)
    edges, edge_snapshot, edge_furniture, edge_object = _make_object_edges(
        memory, queries, snapshots
    )
    links = np.stack([edge_furniture + first_object - snapshots.num_furniture,
                      row[edge_object] + first_object], axis=1)  # fmt: skip
    order = np.argsort(edge_snapshot, kind="stable")
    ends = np.cumsum(np.bincount(edge_snapshot, minlength=snapshots.num_snapshots))[:-1]
    return [
        GraphInstance(
            nodes=np.concatenate([layout[index], own_objects]),
            edges=np.concatenate([layout_edges[index], own_edges]),
            edge_links=np.concatenate([layout_links[index], own_links]).astype(np.int32),
        )
        for index, (own_objects, own_edges, own_links) in enumerate(
            zip(
                np.split(objects, object_start[1:]),
                np.split(edges[order], ends),
                np.split(links[order], ends),
                strict=True,
            )
        )
    ]


def _make_layout_nodes(snapshots: Snapshots) -> np.ndarray:
    """House, floor, rooms and furniture, float32 (Q, 2 + R + F, 8)."""
    num_rooms = snapshots.room_label.shape[1]
    shape = (snapshots.num_snapshots, 2 + num_rooms + snapshots.num_furniture)
    nodes = np.zeros((*shape, len(NODE_FEATURES)), dtype=np.float32)
    furniture = nodes[:, 2 + num_rooms :]
    nodes[:, 1, 0] = 1
    nodes[:, 2 : 2 + num_rooms, 0] = _ROOM
    furniture[..., 0] = _FURNITURE
    nodes[:, 1, 1] = snapshots.labels.index("floor")
    nodes[:, 0, 1] = snapshots.labels.index("house")
    nodes[:, 2 : 2 + num_rooms, 1] = snapshots.room_label
    furniture[..., 1] = snapshots.furniture_label
    nodes[..., 2] = nodes[..., 4] = nodes[..., 6] = -1
    furniture[..., 3] = snapshots.furniture_num_observed
    furniture[..., 4] = _count_since(snapshots.time[:, None], snapshots.furniture_last_observed)
    return nodes


def _make_object_nodes(memory: MemoryBatch, queries: Queries, snapshots: Snapshots) -> np.ndarray:
    """Objects of all snapshots, float32 (N, 8)."""
    nodes = np.zeros((len(snapshots.object_snapshot), len(NODE_FEATURES)), dtype=np.float32)
    time = snapshots.time[snapshots.object_snapshot]
    nodes[:, 0] = _OBJECT
    nodes[:, 1] = snapshots.object_label
    nodes[:, 2] = memory.objects["key"][_find_rows(memory, queries)]
    nodes[:, 3] = snapshots.object_num_observed
    nodes[:, 4] = _count_since(time, snapshots.object_last_observed)
    nodes[:, 5] = snapshots.object_num_moved
    nodes[:, 6] = _count_since(time, snapshots.object_last_moved)
    nodes[snapshots.query_object, 7] = 1
    return nodes


def _find_rows(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Rows of the memory's objects: of each snapshot, those with an edge and the query's, (N,)."""
    has_edge = np.zeros(len(memory.objects), dtype=bool)
    has_edge[memory.edges["object"]] = True
    is_node = has_edge & (memory.objects["home"] == queries.home[:, None])  # (Q, rows)
    is_node[np.arange(len(queries.home)), queries.object] = True
    return np.nonzero(is_node)[1]


def _make_layout_edges(snapshots: Snapshots) -> tuple[np.ndarray, np.ndarray]:
    """House > floor > rooms > furniture: links (Q, 1 + R + F, 2), features (Q, 1 + R + F, 9)."""
    batch, num_rooms = snapshots.room_label.shape
    num_edges = 1 + num_rooms + snapshots.num_furniture
    links = np.empty((batch, num_edges, 2), dtype=np.int32)
    links[..., 1] = np.arange(1, num_edges + 1)
    links[:, 0, 0] = 0
    links[:, 1 : 1 + num_rooms, 0] = 1
    links[:, 1 + num_rooms :, 0] = 2 + snapshots.furniture_room
    edges = np.zeros((batch, num_edges, len(EDGE_FEATURES)), dtype=np.float32)
    edges[..., [_COLUMN["is_remembered"], _COLUMN["is_true"], _COLUMN["prior"]]] = 1
    edges[..., [_COLUMN["steps_since_observed"], _COLUMN["steps_since_changed"]]] = -1
    edges[:, 1 + num_rooms :, _COLUMN["prior"]] = snapshots.furniture_prob
    return links, edges


def _make_object_edges(
    memory: MemoryBatch, queries: Queries, snapshots: Snapshots
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Remembered edges, then hypothetical ones of the queries.

    Returns:
        Features (E, 9), and snapshot, furniture index and object number of each edge, (E,).
    """
    snapshot = snapshots.object_snapshot[snapshots.edge_object]
    time = snapshots.time[snapshot]
    known = np.zeros((len(snapshot), len(EDGE_FEATURES)), dtype=np.float32)
    for name, values in (
        ("relation", snapshots.edge_relation + 1),
        ("is_remembered", 1),
        ("num_observed", snapshots.edge_num_observed),
        ("num_true", snapshots.edge_num_true),
        ("num_changed", snapshots.edge_num_changed),
        ("steps_since_observed", _count_since(time, snapshots.edge_last_observed)),
        ("steps_since_changed", _count_since(time, snapshots.edge_last_changed)),
        ("is_true", snapshots.edge_is_true),
        ("prior", snapshots.edge_prior),
    ):
        known[:, _COLUMN[name]] = values
    is_new = memory.compute_candidates(queries)  # (Q, F, 2)
    query, edge = memory.edges_of(queries)
    is_new[query, memory.edges["furniture"][edge], memory.edges["relation"][edge]] = False
    query, furniture, relation = np.nonzero(is_new)
    proposed = np.zeros((len(query), len(EDGE_FEATURES)), dtype=np.float32)
    proposed[:, _COLUMN["relation"]] = relation % NUM_RELATIONS + 1
    proposed[:, _COLUMN["steps_since_observed"]] = -1
    proposed[:, _COLUMN["steps_since_changed"]] = -1
    proposed[:, _COLUMN["prior"]] = queries.prior[query, furniture, relation]
    return (
        np.concatenate([known, proposed]),
        np.concatenate([snapshot, query]),
        np.concatenate([snapshots.edge_furniture, furniture]),
        np.concatenate([snapshots.edge_object, snapshots.query_object[query]]),
    )


def _count_since(time: np.ndarray, stamp: np.ndarray) -> np.ndarray:
    """Steps since a time stamp, -1 for never."""
    return np.where(stamp == NEVER, -1, time - stamp)

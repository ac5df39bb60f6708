"""Scene graph memories as `gymnasium.spaces.Graph` observations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gymnasium.spaces import Box, Graph, GraphInstance

from sgm.arrays.grouped import compute_starts, mark_rows
from sgm.arrays.relations import NUM_RELATIONS
from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from simulator.snapshots.snapshots import Snapshots, take_snapshots

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
    2 + R + f), then the objects that were ever seen or are asked for; R and F are the home's own.

    Args:
        memory: the memories.
        queries: what is asked, one query per graph, (Q,).
    """
    snapshots = take_snapshots(memory, queries)
    batch = snapshots.num_snapshots
    num_rooms, num_furniture = np.diff(snapshots.first_room), np.diff(snapshots.first_furniture)
    # Number of every node within its graph.
    room = np.arange(len(snapshots.room_label)) - snapshots.first_room[snapshots.room_snapshot] + 2
    own = snapshots.furniture_snapshot
    furniture = np.arange(len(own)) - snapshots.first_furniture[own] + 2 + num_rooms[own]
    own = snapshots.object_snapshot
    first_object = compute_starts(np.bincount(own, minlength=batch))
    item = np.arange(len(own)) - first_object[own] + (2 + num_rooms + num_furniture)[own]

    layout_edges = _make_layout_edges(snapshots, room, furniture)
    object_edges = _make_object_edges(memory, queries, snapshots, furniture, item)
    nodes = [
        _split(_make_room_nodes(snapshots), _add_starts(snapshots.first_room, 2)),
        _split(_make_furniture_nodes(snapshots), snapshots.first_furniture),
        _split(_make_object_nodes(memory, queries, snapshots), first_object),
    ]
    edges = [part.split(batch) for part in (layout_edges, object_edges)]
    return [
        GraphInstance(
            nodes=np.concatenate([part[number] for part in nodes]),
            edges=np.concatenate([part[number][1] for part in edges]),
            edge_links=np.concatenate([part[number][0] for part in edges]),
        )
        for number in range(batch)
    ]


@dataclass(frozen=True, slots=True)
class _Edges:
    """Edges of all graphs: the graph of each (E,), its two ends (E, 2), features (E, 9)."""

    graph: np.ndarray
    links: np.ndarray
    features: np.ndarray

    def split(self, num_graphs: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return links, int32 (e, 2), and features (e, 9) of each graph."""
        order = np.argsort(self.graph, kind="stable")
        first = compute_starts(np.bincount(self.graph, minlength=num_graphs))
        links = _split(self.links[order].astype(np.int32), first)
        return list(zip(links, _split(self.features[order], first), strict=True))


def _split(rows: np.ndarray, first: np.ndarray) -> list[np.ndarray]:
    return np.split(rows, first[1:-1])


def _make_room_nodes(snapshots: Snapshots) -> np.ndarray:
    """House, floor and rooms of each snapshot, float32 (2 B + NR, 8)."""
    first = _add_starts(snapshots.first_room, 2)
    nodes = np.zeros((first[-1], len(NODE_FEATURES)), dtype=np.float32)
    nodes[:, [2, 4, 6]] = -1
    nodes[:, 0] = _ROOM
    house, floor = first[:-1], first[:-1] + 1
    is_room = np.ones(len(nodes), dtype=bool)
    is_room[house] = is_room[floor] = False
    nodes[is_room, 1] = snapshots.room_label
    nodes[house, 0], nodes[floor, 0] = 0, 1
    nodes[house, 1] = snapshots.labels.index("house")
    nodes[floor, 1] = snapshots.labels.index("floor")
    return nodes


def _add_starts(first: np.ndarray, num_more: int) -> np.ndarray:
    """Return the starts of groups with so many more entries each, (n + 1,)."""
    return first + num_more * np.arange(len(first))


def _make_furniture_nodes(snapshots: Snapshots) -> np.ndarray:
    """Furniture of all snapshots, float32 (NF, 8)."""
    nodes = np.zeros((len(snapshots.furniture_label), len(NODE_FEATURES)), dtype=np.float32)
    time = snapshots.time[snapshots.furniture_snapshot]
    nodes[:, 0] = _FURNITURE
    nodes[:, 1] = snapshots.furniture_label
    nodes[:, [2, 6]] = -1
    nodes[:, 3] = snapshots.furniture_num_observed
    nodes[:, 4] = _count_since(time, snapshots.furniture_last_observed)
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
    has_edge = mark_rows(memory.edges["object"], len(memory.objects))
    is_node = has_edge & (memory.objects["home"] == queries.home[:, None])  # (Q, rows)
    is_node[np.arange(len(queries.home)), queries.object] = True
    return np.nonzero(is_node)[1]


def _make_layout_edges(snapshots: Snapshots, room: np.ndarray, furniture: np.ndarray) -> _Edges:
    """House > floor > rooms > furniture of every snapshot.

    Args:
        snapshots: the snapshots.
        room: number of each room within its graph, (NR,).
        furniture: of each furniture node, (NF,).
    """
    batch, num_rooms = snapshots.num_snapshots, len(room)
    links = np.concatenate(
        [
            np.tile([[0, 1]], (batch, 1)),
            np.stack([np.ones(num_rooms, dtype=np.int64), room], axis=1),
            np.stack([room[snapshots.furniture_room], furniture], axis=1),
        ]
    )
    edges = np.zeros((len(links), len(EDGE_FEATURES)), dtype=np.float32)
    edges[:, [_COLUMN["is_remembered"], _COLUMN["is_true"], _COLUMN["prior"]]] = 1
    edges[:, [_COLUMN["steps_since_observed"], _COLUMN["steps_since_changed"]]] = -1
    edges[batch + num_rooms :, _COLUMN["prior"]] = snapshots.furniture_prob
    graph = [np.arange(batch), snapshots.room_snapshot, snapshots.furniture_snapshot]
    return _Edges(np.concatenate(graph), links, edges)


def _make_object_edges(
    memory: MemoryBatch,
    queries: Queries,
    snapshots: Snapshots,
    furniture: np.ndarray,
    item: np.ndarray,
) -> _Edges:
    """Remembered edges, then hypothetical ones of the queries.

    Args:
        memory: the memories.
        queries: what is asked, (Q,).
        snapshots: of these.
        furniture: number of each furniture node within its graph, (NF,).
        item: of each object, (N,).
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
    query, column, relation = np.nonzero(is_new & memory.is_furniture[queries.home][:, :, None])
    proposed = np.zeros((len(query), len(EDGE_FEATURES)), dtype=np.float32)
    proposed[:, _COLUMN["relation"]] = relation % NUM_RELATIONS + 1
    proposed[:, _COLUMN["steps_since_observed"]] = -1
    proposed[:, _COLUMN["steps_since_changed"]] = -1
    proposed[:, _COLUMN["prior"]] = queries.prior[query, column, relation]
    above = np.concatenate([snapshots.edge_furniture, snapshots.first_furniture[query] + column])
    below = np.concatenate([snapshots.edge_object, snapshots.query_object[query]])
    return _Edges(
        graph=np.concatenate([snapshot, query]),
        links=np.stack([furniture[above], item[below]], axis=1),
        features=np.concatenate([known, proposed]),
    )


def _count_since(time: np.ndarray, stamp: np.ndarray) -> np.ndarray:
    """Steps since a time stamp, -1 for never."""
    return np.where(stamp == NEVER, -1, time - stamp)

"""Scene graph memories as `gymnasium.spaces.Graph` observations."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box, Graph, GraphInstance

from sgm.arrays.grouped import compute_starts
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries, propose_rows
from sgm.schema import NEVER, NODE_TYPES, Columns, PlaceCode
from simulator.snapshots.nodes_and_edges import Pairs, join_nodes, propose_edges
from simulator.snapshots.snapshots import Selection, Snapshots
from simulator.snapshots.taken import take_snapshots
from simulator.snapshots.type_numbers import FURNITURE, OBJECT

# kind: by number in `NODE_TYPES`: 0 home, 1 floor, 2 room, 3 furniture, 4 object. label: index into
# `labels`; description: its number, for objects. Steps since what never happened are -1, as is a
# description of what is no object.
NODE_FEATURES = (
    "kind",
    "label",
    "description",
    "num_observed",
    "steps_since_observed",
    "num_moved",
    "steps_since_moved",
    "is_query",
)
# relation: 0 contains, from 1 on as `RELATIONS`. An edge that is not remembered is a hypothetical
# edge of the query object: the prior deems it possible. Edges lead from what holds to what is held.
EDGE_FEATURES = (
    "relation",
    "is_remembered",
    "num_observed",
    "num_true",
    "num_changed",
    "steps_since_observed",
    "steps_since_changed",
    "is_true",
    "prior",
)


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
    Edges of the layout come first, then those remembered, then the hypothetical ones. There are as
    many graphs as queries, Q.
    """
    snapshots = take_snapshots(memory, queries)
    num_graphs = snapshots.num_snapshots
    proposed = propose_rows(
        snapshots.query_prior, snapshots.furniture["snapshot"], num_graphs, memory.threshold
    )
    edges = propose_edges(snapshots, proposed)
    joined, first_node = join_nodes(snapshots)
    pairs = Pairs.list(snapshots, edges, first_node)
    nodes, order, first = _split(
        _make_nodes(snapshots, joined, first_node), num_graphs, joined["snapshot"]
    )
    number = np.empty(len(order), dtype=np.int32)  # of every node within its graph
    number[order] = np.arange(len(order)) - np.repeat(first[:-1], np.diff(first))
    links = np.stack([number[pairs.parent], number[pairs.child]], axis=1)
    features, rank = _make_edges(snapshots, edges, pairs)
    graph_edges, order, first = _split(features, num_graphs, joined["snapshot"][pairs.child], *rank)
    return [
        GraphInstance(*parts)
        for parts in zip(nodes, graph_edges, np.split(links[order], first[1:-1]), strict=True)
    ]


def _split(
    rows: np.ndarray, num_graphs: int, graph: np.ndarray, *rank: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Split rows by their graph, in order of their ranks, the first of which counts most.

    Returns:
        The rows of each graph, the order of all of them, and the first of each graph in it.
    """
    order = np.lexsort((*reversed(rank), graph))
    first = compute_starts(np.bincount(graph, minlength=num_graphs))
    return np.split(rows[order], first[1:-1]), order, first


def _make_nodes(snapshots: Snapshots, joined: Columns, first_node: np.ndarray) -> np.ndarray:
    """Nodes of all snapshots, float32 (N, 8)."""
    nodes = np.zeros((len(joined["label"]), len(NODE_FEATURES)), dtype=np.float32)
    column = dict(zip(NODE_FEATURES, nodes.T, strict=True))  # views
    furniture = slice(*first_node[FURNITURE : FURNITURE + 2])
    objects = slice(*first_node[OBJECT : OBJECT + 2])
    time = snapshots.time[joined["snapshot"]]
    column["kind"][:] = np.repeat(np.arange(len(NODE_TYPES)), np.diff(first_node))
    column["label"][:] = joined["label"]
    for name in ("description", "steps_since_observed", "steps_since_moved"):
        column[name][:] = NEVER
    column["description"][objects] = snapshots.objects["key"]
    for table, rows, name in (
        (snapshots.furniture, furniture, "observed"),
        (snapshots.objects, objects, "observed"),
        (snapshots.objects, objects, "moved"),
    ):
        last = table[f"last_{name}"]
        column[f"num_{name}"][rows] = table[f"num_{name}"]
        column[f"steps_since_{name}"][rows] = _count_since(time[rows], last)
    column["is_query"][objects.start + snapshots.query_object] = 1
    return nodes


def _make_edges(
    snapshots: Snapshots, edges: Selection, pairs: Pairs
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Edges of all snapshots, float32 (P, 9), and the two ranks that order those of a graph."""
    num_layout = pairs.num_layout
    features = np.zeros((num_layout + len(edges.rows), len(EDGE_FEATURES)), dtype=np.float32)
    of_layout, of_edges = (
        dict(zip(EDGE_FEATURES, part.T, strict=True))  # views
        for part in (features[:num_layout], features[num_layout:])
    )
    for name in ("is_remembered", "is_true", "prior"):
        of_layout[name][:] = 1
    of_layout["prior"][pairs.of_furniture] = snapshots.furniture["prob"]
    is_known = edges.rows >= 0
    of_edges["relation"][:] = 1 + edges["relation"]
    of_edges["is_remembered"][:] = is_known
    for name in ("num_observed", "num_true", "num_changed", "is_true", "prior"):
        of_edges[name][:] = edges[name]
    for name in ("observed", "changed"):
        of_layout[f"steps_since_{name}"][:] = NEVER
        last = edges[f"last_{name}"]
        of_edges[f"steps_since_{name}"][:] = _count_since(edges["time"], last)
    place = PlaceCode.of(edges["furniture"], edges["relation"])
    layout = np.arange(num_layout)
    edge_group = np.concatenate([np.zeros_like(layout), np.where(is_known, 1, 2)])
    return features, (edge_group, np.concatenate([layout, np.where(is_known, edges.rows, place)]))


def _count_since(time: np.ndarray, stamp: np.ndarray) -> np.ndarray:
    """Steps since a time stamp, -1 for never."""
    return np.where(stamp == NEVER, -1, time - stamp)

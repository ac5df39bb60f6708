"""Random batches of small scene graph memories, made without simulator or data module."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from torch_geometric.data import HeteroData

from datamodules.batch import Batch
from datamodules.edited_graph import read_batch
from datamodules.feature_config import EDGE_FEATURE_DIM, NODE_FEATURE_DIM, TEXT_DIM
from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES
from simulator.snapshots.type_numbers import ENTERING

NUM_LABELS = 12

# The tensors are tiny: a second thread only waits, for very long on a busy machine.
torch.set_num_threads(1)


def make_batch(
    seed: int, num_snapshots: int = 3, num_furniture: int = 5, num_objects: int = 8
) -> Batch:
    """Snapshots with the house, floor, 2 rooms, furniture, objects, and one query object each.

    Node n of a type belongs to snapshot n // (nodes of the type per snapshot). All labels,
    features, remembered object edges and targets are random; every edge is present in both
    directions.
    """
    rng = np.random.default_rng(seed)
    per_snapshot = {
        "house": 1,
        "floor": 1,
        "room": 2,
        "furniture": num_furniture,
        "object": num_objects,
    }
    parents: dict[str, list[tuple[int, int]]] = {"in": [], "onTop": []}  # (object, furniture)
    queries: dict[str, list[int]] = {"in": [], "onTop": []}
    up: dict[str, list[tuple[int, int]]] = {"floor": [], "room": [], "furniture": []}
    for snapshot in range(num_snapshots):
        first = {ntype: snapshot * count for ntype, count in per_snapshot.items()}
        up["floor"].append((first["floor"], first["house"]))
        up["room"] += [(first["room"] + room, first["floor"]) for room in range(2)]
        up["furniture"] += [
            (first["furniture"] + place, first["room"] + place % 2)
            for place in range(num_furniture)
        ]
        for item in range(num_objects):
            for place in range(num_furniture):
                is_query = item == 0
                if is_query or rng.random() < 0.3:
                    relation = "in" if rng.random() < 0.4 else "onTop"
                    parents[relation].append((first["object"] + item, first["furniture"] + place))
                    queries[relation].append(snapshot if is_query else -1)

    pairs = {
        ("floor", "in", "house"): up["floor"],
        ("room", "in", "floor"): up["room"],
        ("furniture", "in", "room"): up["furniture"],
        ("object", "in", "furniture"): parents["in"],
        ("object", "onTop", "furniture"): parents["onTop"],
    }
    for (src, relation, dst), edges in list(pairs.items()):
        back = (dst, {"in": "contains", "onTop": "under"}[relation], src)
        pairs[back] = [(b, a) for a, b in edges]
    graph = HeteroData()
    for etype in EDGE_TYPES:
        ends = torch.tensor(pairs[etype], dtype=torch.int64).reshape(-1, 2)
        graph[etype].edge_index = ends.T
    for ntype in NODE_TYPES:
        count = num_snapshots * per_snapshot[ntype]
        degrees = torch.zeros(count, 3)
        for column, etype in enumerate(ENTERING[ntype]):
            degrees[:, column] = graph[etype].edge_index[1].bincount(minlength=count)
        graph[ntype].num_nodes = count
        graph[ntype].label = torch.from_numpy(rng.integers(NUM_LABELS, size=count))
        graph[ntype].temporal = _uniform(rng, count, NODE_FEATURE_DIM)
        graph[ntype].degrees = degrees
        graph[ntype].snapshot = torch.arange(count) // per_snapshot[ntype]
    graph["furniture"].index = torch.arange(num_furniture).repeat(num_snapshots)
    for etype in EDGE_TYPES:
        graph[etype].feature = _uniform(rng, graph[etype].num_edges, EDGE_FEATURE_DIM)
    for etype in QUERY_EDGE_TYPES:
        query = torch.tensor(queries[etype[1]], dtype=torch.int64)
        target = torch.from_numpy(rng.random(len(query)) < 0.3).float()
        graph[etype].query = query
        graph[etype].target = torch.where(query >= 0, target, torch.nan)
    text = torch.from_numpy(np.random.default_rng(0).random((NUM_LABELS, TEXT_DIM), np.float32))
    return read_batch(graph, text, num_snapshots)


def _uniform(rng: np.random.Generator, rows: int, columns: int) -> torch.Tensor:
    return torch.from_numpy(rng.random((rows, columns), np.float32))


@pytest.fixture
def random_batch() -> Callable[..., Batch]:
    """`make_batch`."""
    return make_batch


@pytest.fixture
def take_snapshot() -> Callable[[Batch, int], Batch]:
    """Cut one snapshot out of a batch of `make_batch`."""

    def take(batch: Batch, snapshot: int) -> Batch:
        graph = batch.to_pyg()
        part = graph.subgraph({ntype: graph[ntype].batch == snapshot for ntype in NODE_TYPES})
        for etype in QUERY_EDGE_TYPES:
            part[etype].query = torch.where(part[etype].query >= 0, 0, -1)
        for ntype in NODE_TYPES:
            part[ntype]["snapshot"] = torch.zeros_like(part[ntype]["snapshot"])
        return read_batch(part, batch.text, 1)

    return take


@pytest.fixture
def edit_edges() -> Callable[..., Batch]:
    """Rebuild a batch with other edges: `edit(etype, src, dst) -> mask of edges to keep`."""

    def edit(batch: Batch, keep: Callable[[Any, torch.Tensor, torch.Tensor], Any]) -> Batch:
        graph = batch.to_pyg()
        for etype in EDGE_TYPES:
            kept = keep(etype, *graph[etype].edge_index)
            for name, values in list(graph[etype].items()):
                graph[etype][name] = values[:, kept] if name == "edge_index" else values[kept]
        return read_batch(graph, batch.text, batch.num_snapshots)

    return edit

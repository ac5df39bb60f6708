"""Snapshots to one batched heterogeneous DGL graph, built once per batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch

from datamodules.batch import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES, TEXT_DIM, SGMBatch
from datamodules.features import (
    BELIEF_DIM,
    CLOCK_DIM,
    FeatureConfig,
    compute_belief_features,
    compute_clock_features,
    compute_edge_features,
    compute_furniture_temporal,
    compute_hypothetical_features,
    compute_layout_features,
    compute_object_temporal,
    drop_features,
    require_clock,
)
from datamodules.heterograph import make_heterograph
from datamodules.text import TextVectors
from simulator.memory.candidates import propose_places, sample_places
from simulator.memory.memory_batch import NEVER
from simulator.memory.snapshots import Snapshots, forget


class GraphBuilder:
    """Turns snapshots into batches for a model.

    Concatenates arrays, offsets ids and builds one graph: no object per snapshot, node or edge.
    """

    def __init__(self, config: FeatureConfig, num_hops: int | None = None, seed: int = 0) -> None:
        """Load the text vectors.

        Args:
            config: which features.
            num_hops: keep only the `num_hops`-hop in-neighbourhood of the query edges' ends,
                which is all that a model with so many convolutions can read; None keeps all.
            seed: of randomly chosen hypothetical edges.
        """
        self.config = config
        self.num_hops = num_hops
        self._rng = np.random.default_rng(seed)
        self._text = _load_text(config.text_pipeline)
        self._labels: tuple[str, ...] = ()
        self._table = (torch.zeros(0, TEXT_DIM), np.zeros((0, 0), dtype=np.float32))

    def build(self, snapshots: Snapshots) -> SGMBatch:
        """Build the batch of B snapshots."""
        if not self.config.memory:
            snapshots = forget(snapshots)
        text, cosine = self._get_text(snapshots.labels)
        nodes = _Nodes.count(snapshots)
        proposed = self._propose(snapshots)
        edges = _list_edges(snapshots, nodes, proposed)
        degree = np.bincount(edges.dst, minlength=nodes.total)
        keep_node, keep_edge = self._prune(nodes, edges)
        number = np.cumsum(keep_node) - 1 - nodes.kept_before(keep_node)

        labels = np.concatenate([nodes.label, snapshots.object_label])
        kept_objects = np.flatnonzero(keep_node[nodes.first["object"] :])
        temporal = np.zeros((nodes.total, 4), dtype=np.float32)
        furniture = slice(nodes.first["furniture"], nodes.first["object"])
        temporal[furniture] = compute_furniture_temporal(snapshots)
        temporal[nodes.first["object"] + kept_objects] = compute_object_temporal(
            snapshots, kept_objects
        )
        kept = edges.take(keep_edge)
        feature = _compute_features(snapshots, kept, cosine[labels[kept.src], labels[kept.dst]])
        drop_features(temporal, feature, self.config)
        if self.config.belief:
            feature = _append_belief(snapshots, kept, nodes, feature)
        if self.config.clock:
            feature = _append_clock(snapshots, kept, feature)
        grade = _compute_grades(snapshots, kept, nodes)

        graph = make_heterograph(
            {
                etype: (
                    torch.from_numpy(number[kept.src[kept.of_type(etype)]]),
                    torch.from_numpy(number[kept.dst[kept.of_type(etype)]]),
                )
                for etype in EDGE_TYPES
            },
            {ntype: int(keep_node[nodes.range(ntype)].sum()) for ntype in NODE_TYPES},
        )
        for ntype in NODE_TYPES:
            rows = nodes.first[ntype] + np.flatnonzero(keep_node[nodes.range(ntype)])
            data = graph.nodes[ntype].data
            data["label"] = torch.from_numpy(labels[rows].astype(np.int64))
            data["temporal"] = torch.from_numpy(temporal[rows])
            data["degree"] = torch.from_numpy(degree[rows].astype(np.float32))
            if ntype == "furniture":
                local = (rows - nodes.first[ntype]) % snapshots.num_furniture
                data["index"] = torch.from_numpy(local)
        for etype in EDGE_TYPES:
            data = graph.edges[etype].data
            data["feature"] = torch.from_numpy(feature[kept.of_type(etype)])
            if etype in QUERY_EDGE_TYPES:
                data["query"] = torch.from_numpy(kept.query[kept.of_type(etype)])
                data["target"] = torch.from_numpy(kept.target[kept.of_type(etype)])
                if grade is not None:
                    data["grade"] = torch.from_numpy(grade[kept.of_type(etype)])
        return SGMBatch(graph, text, snapshots.num_snapshots)

    def _get_text(self, labels: tuple[str, ...]) -> tuple[torch.Tensor, np.ndarray]:
        """Return the text table (L, 96) and the cosine of every pair (L, L)."""
        if labels != self._labels:  # a memory in use learns new labels now and then
            vectors = self._text.vectors(labels)
            if not self.config.semantic:
                vectors = np.zeros_like(vectors)
            self._labels = labels
            self._table = (torch.from_numpy(vectors), self._text.cosines(labels))
        return self._table

    def compute_cosines(self, labels: Sequence[str]) -> np.ndarray:
        """Return the cosine of the text vectors of every pair of labels, float32 (L, L)."""
        return self._get_text(tuple(labels))[1]

    @property
    def text_name(self) -> str:
        """Name and version of the text vectors; a model fits the ones it was trained with."""
        return self._text.name

    def _propose(self, snapshots: Snapshots) -> np.ndarray:
        """Mark the hypothetical edges of each query: proposed and not remembered, (B, F, 2)."""
        if self.config.candidates == "random":
            shape = (snapshots.num_snapshots, snapshots.num_furniture)
            proposed = sample_places(shape, self.config.random_candidates, rng=self._rng)
        else:
            proposed = propose_places(snapshots.query_prior, self.config.threshold)
        snapshot = snapshots.object_snapshot[snapshots.edge_object]
        own = np.flatnonzero(snapshots.query_object[snapshot] == snapshots.edge_object)
        proposed[snapshot[own], snapshots.edge_furniture[own], snapshots.edge_relation[own]] = False
        return proposed

    def _prune(self, nodes: _Nodes, edges: _Edges) -> tuple[np.ndarray, np.ndarray]:
        """Mark the nodes and edges that the model can read, (N,) and (E,)."""
        if self.num_hops is None:
            return np.ones(nodes.total, dtype=bool), np.ones(len(edges.src), dtype=bool)
        is_query = edges.query >= 0
        keep_node = np.zeros(nodes.total, dtype=bool)
        keep_node[edges.src[is_query]] = True
        keep_node[edges.dst[is_query]] = True
        keep_edge = is_query
        for _ in range(self.num_hops):
            keep_edge = keep_node[edges.dst] | is_query
            keep_node = keep_node.copy()
            keep_node[edges.src[keep_edge]] = True
        return keep_node, keep_edge


@lru_cache(maxsize=2)
def _load_text(pipeline: str | None) -> TextVectors:
    """Load text vectors once per process: it takes a quarter of a second."""
    return TextVectors(pipeline)


@dataclass(frozen=True, slots=True)
class _Nodes:
    """Nodes of all types in one row of ids, type after type.

    Attributes:
        first: first id of each node type.
        total: number of nodes.
        label: label of every node but the objects.
    """

    first: dict[str, int]
    total: int
    label: np.ndarray

    @classmethod
    def count(cls, snapshots: Snapshots) -> _Nodes:
        """Number the nodes of snapshots."""
        batch = snapshots.num_snapshots
        house, floor = (snapshots.labels.index(label) for label in ("house", "floor"))
        parts = [
            np.full(batch, house),
            np.full(batch, floor),
            snapshots.room_label.ravel(),
            snapshots.furniture_label.ravel(),
        ]
        counts = [*(len(part) for part in parts), len(snapshots.object_label)]
        starts = np.cumsum([0, *counts])
        first = dict(zip(NODE_TYPES, starts[:-1].tolist(), strict=True))
        return cls(first, int(starts[-1]), np.concatenate(parts))

    def range(self, ntype: str) -> slice:
        """Return the ids of a node type."""
        index = NODE_TYPES.index(ntype)
        last = index == len(NODE_TYPES) - 1
        return slice(self.first[ntype], self.total if last else self.first[NODE_TYPES[index + 1]])

    def kept_before(self, keep: np.ndarray) -> np.ndarray:
        """Return, per node, how many kept nodes there are of earlier types, (N,)."""
        before = np.empty(self.total, dtype=np.int64)
        for ntype in NODE_TYPES:
            before[self.range(ntype)] = keep[: self.first[ntype]].sum()
        return before


@dataclass(frozen=True, slots=True)
class _Edges:
    """Edges of all types in one list, in the order of `EDGE_TYPES`.

    Attributes:
        src, dst: node ids, (E,).
        source: where the features come from: a remembered edge (0 <= i < M), a hypothetical edge
            (M <= i < M + H), or the layout (negative: `_CERTAIN`, or `_FIRST_FURNITURE` minus
            the furniture node), (E,).
        query: snapshot whose query edge it is, or -1, (E,).
        target: 1 or 0 for query edges with a known answer, else nan, float32 (E,).
        bounds: start of each edge type, 11 of them.
        hypothetical: snapshot, furniture and relation of each hypothetical edge, 3 x (H,).
    """

    src: np.ndarray
    dst: np.ndarray
    source: np.ndarray
    query: np.ndarray
    target: np.ndarray
    bounds: np.ndarray
    hypothetical: tuple[np.ndarray, ...]

    def of_type(self, etype: tuple[str, str, str]) -> slice:
        """Return the range of an edge type."""
        index = EDGE_TYPES.index(etype)
        return slice(self.bounds[index], self.bounds[index + 1])

    def take(self, keep: np.ndarray) -> _Edges:
        """Keep some of the edges."""
        counts = np.concatenate([[0], np.cumsum(keep)])
        return _Edges(
            self.src[keep], self.dst[keep], self.source[keep], self.query[keep],
            self.target[keep], counts[self.bounds], self.hypothetical,
        )  # fmt: skip


# What an edge of the layout reads its prior from: nothing (probability 1) or its furniture node.
_CERTAIN = -1
_FIRST_FURNITURE = -2


def _list_edges(snapshots: Snapshots, nodes: _Nodes, proposed: np.ndarray) -> _Edges:
    """List all edges in both directions, remembered ones before hypothetical ones."""
    batch, num_furniture = snapshots.furniture_label.shape
    num_rooms = snapshots.room_label.shape[1]
    house = nodes.first["house"] + np.arange(batch)
    floor = nodes.first["floor"] + np.arange(batch)
    room = nodes.first["room"] + np.arange(batch * num_rooms)
    floor_of_room = np.repeat(floor, num_rooms)
    furniture = nodes.first["furniture"] + np.arange(batch * num_furniture)
    room_of_furniture = (
        nodes.first["room"]
        + np.repeat(np.arange(batch) * num_rooms, num_furniture)
        + snapshots.furniture_room.ravel()
    )
    hypothetical = np.nonzero(proposed)
    snapshot = np.concatenate([snapshots.object_snapshot[snapshots.edge_object], hypothetical[0]])
    local = np.concatenate([snapshots.edge_furniture, hypothetical[1]])
    relation = np.concatenate([snapshots.edge_relation, hypothetical[2]])
    objects = np.concatenate([snapshots.edge_object, snapshots.query_object[hypothetical[0]]])
    is_query = snapshots.query_object[snapshot] == objects
    query = np.where(is_query, snapshot, -1)
    target = np.full(len(objects), np.nan, dtype=np.float32)
    if snapshots.answers is not None:
        truth = snapshots.answers[snapshot, local]
        target = np.where(is_query, truth, np.nan).astype(np.float32)
    dynamic_src = nodes.first["object"] + objects
    dynamic_dst = nodes.first["furniture"] + snapshot * num_furniture + local
    inside, on_top = np.flatnonzero(relation == 0), np.flatnonzero(relation == 1)

    certain_rooms = np.full(len(room), _CERTAIN)
    by_furniture = _FIRST_FURNITURE - np.arange(len(furniture))
    certain_house = np.full(batch, _CERTAIN)
    parts = [
        (house, floor, certain_house, None),
        (floor, house, certain_house, None),
        (floor_of_room, room, certain_rooms, None),
        (room, floor_of_room, certain_rooms, None),
        (room_of_furniture, furniture, by_furniture, None),
        (furniture, room_of_furniture, by_furniture, None),
        (dynamic_dst[inside], dynamic_src[inside], inside, None),
        (dynamic_src[inside], dynamic_dst[inside], inside, inside),
        (dynamic_src[on_top], dynamic_dst[on_top], on_top, on_top),
        (dynamic_dst[on_top], dynamic_src[on_top], on_top, None),
    ]
    return _Edges(
        src=np.concatenate([part[0] for part in parts]),
        dst=np.concatenate([part[1] for part in parts]),
        source=np.concatenate([part[2] for part in parts]),
        query=np.concatenate(
            [np.full(len(p[0]), -1) if p[3] is None else query[p[3]] for p in parts]
        ),
        target=np.concatenate(
            [
                np.full(len(p[0]), np.nan, dtype=np.float32) if p[3] is None else target[p[3]]
                for p in parts
            ]
        ),
        bounds=np.cumsum([0, *(len(part[0]) for part in parts)]),
        hypothetical=hypothetical,
    )


def _compute_features(snapshots: Snapshots, edges: _Edges, cosine: np.ndarray) -> np.ndarray:
    """Compute the features of edges of every kind, float32 (E, 9)."""
    features = np.empty((len(edges.src), 9), dtype=np.float32)
    num_remembered = len(snapshots.edge_object)
    is_layout = edges.source < 0
    is_remembered = ~is_layout & (edges.source < num_remembered)
    is_hypothetical = edges.source >= num_remembered
    features[is_remembered] = compute_edge_features(
        snapshots, edges.source[is_remembered], cosine[is_remembered]
    )
    rows = edges.source[is_hypothetical] - num_remembered
    place = tuple(index[rows] for index in edges.hypothetical)
    features[is_hypothetical] = compute_hypothetical_features(
        snapshots.time[place[0]], snapshots.query_prior[place], cosine[is_hypothetical]
    )
    layout = edges.source[is_layout]
    prob = snapshots.furniture_prob.ravel()[np.maximum(_FIRST_FURNITURE - layout, 0)]
    features[is_layout] = compute_layout_features(
        np.where(layout == _CERTAIN, 1.0, prob), cosine[is_layout]
    )
    return features


def _append_belief(
    snapshots: Snapshots, edges: _Edges, nodes: _Nodes, feature: np.ndarray
) -> np.ndarray:
    """Append the belief features of query edges, zero for other edges, (E, 9) -> (E, 14).

    Raises:
        ValueError: if the snapshots hold no belief.
    """
    if snapshots.query_belief is None:
        raise ValueError(
            "snapshots must hold a belief for `features.belief`, got none. Collect with "
            "`--belief`, or switch the feature off."
        )
    columns = np.zeros((len(feature), BELIEF_DIM), dtype=np.float32)
    is_query, place = _find_query_places(snapshots, edges, nodes)
    belief = snapshots.query_belief[place]
    columns[is_query] = compute_belief_features(belief)
    return np.concatenate([feature, columns], axis=1)


def _append_clock(snapshots: Snapshots, edges: _Edges, feature: np.ndarray) -> np.ndarray:
    """Append the clock features of edges of objects, zero for the layout, (E, D) -> (E, D + 8).

    Raises:
        ValueError: if it is not known of every snapshot what time it was.
    """
    clock = require_clock(snapshots.clock)
    num_remembered = len(snapshots.edge_object)
    rows = np.flatnonzero(edges.source >= 0)
    source = edges.source[rows]
    # Of remembered edges, then of hypothetical ones, as `source` numbers them.
    snapshot = np.concatenate(
        [snapshots.object_snapshot[snapshots.edge_object], edges.hypothetical[0]]
    )
    never = np.full(len(snapshot) - num_remembered, NEVER)
    last_true = np.concatenate([snapshots.edge_last_true, never])[source]
    snapshot = snapshot[source]
    columns = np.zeros((len(feature), CLOCK_DIM), dtype=np.float32)
    columns[rows] = compute_clock_features(clock[snapshot], snapshots.time[snapshot], last_true)
    return np.concatenate([feature, columns], axis=1)


def _compute_grades(snapshots: Snapshots, edges: _Edges, nodes: _Nodes) -> np.ndarray | None:
    """Return what the place of each query edge is worth, 0 for other edges, float32 (E,)."""
    if snapshots.query_grades is None:
        return None
    grade = np.zeros(len(edges.src), dtype=np.float32)
    is_query, place = _find_query_places(snapshots, edges, nodes)
    grade[is_query] = snapshots.query_grades[place]
    return grade


def _find_query_places(
    snapshots: Snapshots, edges: _Edges, nodes: _Nodes
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Find the query edges (n,), and the snapshot and furniture of each, (n,) and (n,)."""
    is_query = np.flatnonzero(edges.query >= 0)
    furniture = (edges.dst[is_query] - nodes.first["furniture"]) % snapshots.num_furniture
    return is_query, (edges.query[is_query], furniture)

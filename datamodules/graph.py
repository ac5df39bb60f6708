"""Snapshots to a batch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from datamodules.batch import Batch
from datamodules.feature_rows import EdgeRows, LayoutRows, NodeRows, QuestionRows
from datamodules.features import TABLES, TEXT_DIM, FeatureConfig, count_columns, list_columns
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.memory.queries import propose_rows, sample_places
from sgm.text import load_text
from simulator.snapshots.graph import (
    FIRST_OBJECT_TYPE,
    FURNITURE,
    MAX_ENTERING,
    OBJECT,
    OBJECT_UP,
    SnapshotGraph,
)
from simulator.snapshots.snapshots import Snapshots, forget, forget_absence


class GraphBuilder:
    """Turns snapshots into batches for a model: no object per snapshot, node or edge."""

    def __init__(self, config: FeatureConfig, num_hops: int | None = None, seed: int = 0) -> None:
        """Load the text vectors.

        Args:
            config: which features.
            num_hops: keep only the `num_hops`-hop in-neighbourhood of the query edges' ends,
                which is all that a model with so many convolutions can read; None keeps all. With
                0 there are no degrees either.
            seed: of randomly chosen hypothetical edges.
        """
        self.config = config
        self.num_hops = num_hops
        on = config.groups
        self._width = {table: count_columns(table, on) for table in TABLES}
        self._columns = {
            table: [(feature, where) for feature, where in list_columns(table, on)
                    if feature.group in on]
            for table in TABLES
        }  # fmt: skip
        self._rng = np.random.default_rng(seed)
        self._text = load_text(config.text_pipeline)
        self._labels: tuple[str, ...] = ()
        # No tensors: those made while a network plays, in inference mode, cannot be trained on.
        self._table = (np.zeros((0, TEXT_DIM), np.float32), np.zeros((0, 0), np.float32))

    def build(self, snapshots: Snapshots) -> Batch:
        """Build the batch of B snapshots.

        Raises:
            ValueError: if they do not hold what a feature is computed from.
        """
        if not self.config.memory:
            snapshots = forget(snapshots)
        if not self.config.absence:
            snapshots = forget_absence(snapshots)
        text, cosine = self._get_text(snapshots.labels)
        is_all = self.config.candidates == "all"
        graph = SnapshotGraph.from_snapshots(snapshots, self._propose(snapshots), is_all)
        is_kept, pair, is_up, first_edge = graph.list_edges(self.num_hops)
        node, number_of_node = np.flatnonzero(is_kept), np.cumsum(is_kept) - 1
        first_node = np.searchsorted(node, graph.first_node)
        furniture, objects = (
            NodeRows(snapshots, name, node[start:end] - graph.first_node[kind])
            for name, kind, start, end in (
                ("furniture", FURNITURE, *first_node[FURNITURE : FURNITURE + 2]),
                ("object", OBJECT, *first_node[OBJECT : OBJECT + 2]),
            )
        )
        child, parent = graph.child[pair], graph.parent[pair]
        src, dst = np.where(is_up, child, parent), np.where(is_up, parent, child)
        edge_cosine = cosine[graph.label[src], graph.label[dst]]
        num_layout = int(first_edge[FIRST_OBJECT_TYPE])
        joined = pair[num_layout:] - graph.num_layout
        edges = EdgeRows(
            snapshots, graph.remembered[joined], graph.furniture[joined], graph.is_on_top[joined],
            edge_cosine[num_layout:],
        )  # fmt: skip
        upward = slice(*first_edge[[OBJECT_UP.start, OBJECT_UP.stop]].tolist())
        is_asked = graph.is_query[joined[upward.start - num_layout : upward.stop - num_layout]]
        query_edge = np.flatnonzero(is_asked) + upward.start

        asked = edges.furniture[query_edge - num_layout]
        target = np.full(len(asked), np.nan, dtype=np.float32)
        if snapshots.answers is not None:
            target[:] = snapshots.answers[asked]
        relevance = snapshots.extras.get("relevance")
        degrees = np.zeros((len(node), MAX_ENTERING), dtype=np.float32)
        if self.num_hops != 0:
            degrees = graph.compute_degrees()[node]
        node_snapshot = graph.snapshot[node]
        arrays = {
            "label": graph.label[node],
            "node_feature": self._compute_nodes(first_node, furniture, objects),
            "degrees": degrees,
            "node_snapshot": node_snapshot,
            "furniture_index": furniture.rows - snapshots.first_furniture[furniture.snapshot],
            "edge_src": number_of_node[src],
            "edge_dst": number_of_node[dst],
            "edge_feature": self._compute_edges(
                edges, query_edge, edge_cosine, _read_prob(snapshots, graph, pair[:num_layout])
            ),
            "query_edge": query_edge,
            "query_snapshot": graph.snapshot[dst[query_edge]],
            "query_target": target,
            "query_relevance": None if relevance is None else relevance[asked].astype(np.float32),
            "evidence": self._compute_evidence("place", furniture, len(furniture.rows)),
            "question": self._compute_evidence(
                "question", QuestionRows(snapshots), snapshots.num_snapshots
            ),
            "text": text,
        }
        return Batch(
            node_counts=tuple(np.diff(first_node).tolist()),
            edge_counts=tuple(np.diff(first_edge).tolist()),
            num_snapshots=snapshots.num_snapshots,
            **{name: _as_tensor(values) for name, values in arrays.items()},
        )

    def _compute_nodes(
        self, first_node: np.ndarray, furniture: NodeRows, objects: NodeRows
    ) -> np.ndarray:
        """Compute the features of all nodes, float32 (N, D); (N, 0) if none of them are on."""
        columns = self._columns["node"]
        width = self._width["node"] if columns else 0
        values = np.zeros((first_node[-1], width), dtype=np.float32)
        parts = (values[slice(*first_node[kind : kind + 2])] for kind in (FURNITURE, OBJECT))
        for rows, part in zip((furniture, objects), parts, strict=True):
            for feature, where in columns:
                if feature.of in ("node", rows.kind):
                    part[:, where] = _as_columns(feature.compute(rows))
        return values

    def _compute_edges(
        self, edges: EdgeRows, query_edge: np.ndarray, cosine: np.ndarray, prob: np.ndarray
    ) -> np.ndarray:
        """Compute the features of all edges, those of the layout first, float32 (E, D).

        `edges` are those that join objects, `query_edge` some of all edges, and `prob` is the prior
        of those of the layout; `cosine` is of the text vectors of all edges' nodes, (E,).
        """
        num_layout = len(prob)
        values = np.zeros((len(cosine), self._width["edge"]), np.float32)
        layout = LayoutRows(cosine[:num_layout], prob)
        for feature, where in self._columns["edge"]:
            if feature.of == "query edge":
                asked = edges.select(query_edge - num_layout)
                values[query_edge, where] = _as_columns(feature.compute(asked))
                continue
            values[num_layout:, where] = _as_columns(feature.compute(edges))
            if feature.of == "edge":
                known = feature.compute(layout) if feature.layout is None else feature.layout
                values[:num_layout, where] = _as_columns(known)
        return values

    def _compute_evidence(
        self, table: str, rows: NodeRows | QuestionRows, count: int
    ) -> np.ndarray | None:
        """Compute what the memory says of places or questions, (n, D); None if that is off."""
        columns = self._columns[table]
        if not columns:
            return None
        values = np.zeros((count, self._width[table]), dtype=np.float32)
        names = {"place": PLACE_COLUMNS, "question": QUESTION_COLUMNS}[table]
        for feature, where in columns:
            values[:, where] = _as_columns(feature.compute(rows))
            if feature.group == "evidence":
                without = self.config.evidence_without
                values[:, where] *= [name.partition(".")[0] not in without for name in names]
        return values

    def _get_text(self, labels: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Return the text table (L, 96) or (L, 0) and the cosine of every pair (L, L)."""
        if labels != self._labels:  # a memory in use learns new labels now and then
            vectors = self._text.vectors(labels)
            if not self.config.semantic:
                vectors = vectors[:, :0]
            self._labels = labels
            self._table = (vectors, self._text.cosines(labels))
        return self._table

    @property
    def reads_asked_alone(self) -> bool:
        """Whether what else is in a memory than the objects asked for makes no difference."""
        read = (feature for columns in self._columns.values() for feature, _ in columns)
        return self.num_hops == 0 and not any(feature.reads_others for feature in read)

    @property
    def text_name(self) -> str:
        """Name and version of the text vectors; a model fits the ones it was trained with."""
        return self._text.name

    def _propose(self, snapshots: Snapshots) -> np.ndarray:
        """Mark the places where each query object may be, bool (NF, 2)."""
        if self.config.candidates == "random":
            counts = np.diff(snapshots.first_furniture)
            return sample_places(counts, self.config.random_candidates, rng=self._rng)
        if self.config.candidates == "all":  # where the prior puts it there, else on top
            is_in = snapshots.query_prior[:, 0] > snapshots.query_prior[:, 1]
            return np.stack([is_in, ~is_in], axis=1)
        return propose_rows(
            snapshots.query_prior, snapshots.furniture_snapshot, snapshots.num_snapshots,
            self.config.threshold,
        )  # fmt: skip


def _read_prob(snapshots: Snapshots, graph: SnapshotGraph, pairs: np.ndarray) -> np.ndarray:
    """Return the prior of edges of the layout; those between rooms, floor and home are certain."""
    furniture = pairs - graph.first_pair[2]
    return np.where(furniture < 0, 1.0, snapshots.furniture_prob[np.maximum(furniture, 0)])


def _as_columns(values: np.ndarray | float) -> np.ndarray:
    """Return values (n,) as a column; a number stands for all rows."""
    values = np.asarray(values)
    return values if values.ndim == 2 else values.reshape(-1, 1)


def _as_tensor(values: np.ndarray | None) -> Any:
    return None if values is None else torch.from_numpy(values)

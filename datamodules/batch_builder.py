"""Snapshots to a batch."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import torch

from datamodules.batch import Batch
from datamodules.feature_config import TEXT_DIM, FeatureConfig, count_columns, list_columns
from datamodules.paper_features import TABLES, Of
from datamodules.pruning import prune
from sgm.arrays.grouped import choose_relations
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.memory.queries import propose_rows, sample_places
from sgm.schema import NUM_RELATIONS, Columns
from sgm.text import load_text
from simulator.snapshots.nodes_and_edges import Pairs, join_nodes, propose_edges
from simulator.snapshots.snapshots import Selection, Snapshots, forget, forget_absence
from simulator.snapshots.type_numbers import (
    FIRST_REMEMBERED_TYPE,
    FURNITURE,
    MAX_ENTERING,
    OBJECT,
    OBJECT_UP,
)


class BatchBuilder:
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
            table: [
                (feature, where)
                for feature, where in list_columns(table, on)
                if feature.group in on
            ]
            for table in TABLES
        }
        if not self._columns["node"]:
            self._width["node"] = 0
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
        edges = propose_edges(snapshots, self._propose(snapshots), is_all)
        nodes, first_node = join_nodes(snapshots)
        pairs = Pairs.list(snapshots, edges, first_node)
        is_kept, down, up = prune(pairs, edges["is_query"], self.num_hops)
        pair, is_up, first_edge = pairs.list_edges(down, up)
        node, number_of_node = np.flatnonzero(is_kept), np.cumsum(is_kept) - 1
        first_kept = np.searchsorted(node, first_node)
        furniture_nodes, object_nodes = (
            slice(*first_kept[ntype : ntype + 2]) for ntype in (FURNITURE, OBJECT)
        )
        furniture = snapshots.select("furniture", node[furniture_nodes] - first_node[FURNITURE])
        objects = snapshots.select("objects", node[object_nodes] - first_node[OBJECT])
        child, parent = pairs.child[pair], pairs.parent[pair]
        src, dst = np.where(is_up, child, parent), np.where(is_up, parent, child)
        edge_cosine = cosine[nodes["label"][src], nodes["label"][dst]]
        num_layout = int(first_edge[FIRST_REMEMBERED_TYPE])
        edges = edges.select(pair[num_layout:] - pairs.num_layout)
        edges["cosine"] = edge_cosine[num_layout:]
        prior = np.ones(pairs.num_layout)
        prior[pairs.of_furniture] = snapshots.furniture["prob"]
        layout = {"cosine": edge_cosine[:num_layout], "prior": prior[pair[:num_layout]]}
        upward = slice(*(first_edge[[OBJECT_UP.start, OBJECT_UP.stop]] - num_layout).tolist())
        query = np.flatnonzero(edges["is_query"][upward]) + upward.start
        asked, query_edge = edges.select(query), query + num_layout
        degrees = np.zeros((len(node), MAX_ENTERING), dtype=np.float32)
        if self.num_hops != 0:
            degrees = pairs.compute_degrees()[node]
        first_furniture = snapshots.find_first("furniture")[furniture["snapshot"]]
        questions = snapshots.select("questions", np.arange(snapshots.num_snapshots))
        arrays = {
            "label": nodes["label"][node],
            "node_feature": self._compute(
                "node",
                len(node),
                (furniture, furniture_nodes, ("node", "furniture")),
                (objects, object_nodes, ("node", "object")),
            ),
            "degrees": degrees,
            "node_snapshot": nodes["snapshot"][node],
            "furniture_index": furniture.rows - first_furniture,
            "edge_src": number_of_node[src],
            "edge_dst": number_of_node[dst],
            "edge_feature": self._compute(
                "edge",
                len(pair),
                (layout, slice(num_layout), ("edge",)),
                (edges, slice(num_layout, None), ("edge", "object edge")),
                (asked, query_edge, ("query edge",)),
            ),
            "query_edge": query_edge,
            "query_snapshot": asked["snapshot"],
            **_list_targets(snapshots, asked),
            "evidence": self._compute_evidence("place", furniture),
            "question": self._compute_evidence("question", questions),
            "text": text,
        }
        tensors: dict[str, Any] = {
            name: None if values is None else torch.from_numpy(values)
            for name, values in arrays.items()
        }
        return Batch(
            node_counts=tuple(np.diff(first_kept).tolist()),
            edge_counts=tuple(np.diff(first_edge).tolist()),
            num_snapshots=snapshots.num_snapshots,
            **tensors,
        )

    def _compute(
        self, table: str, count: int, *parts: tuple[Columns, Any, tuple[Of, ...]]
    ) -> np.ndarray:
        """Compute the features of one of `TABLES`, float32 (count, D); zero where there are none.

        Each of its parts has columns, where it is in the table, and of what its features are.
        """
        values = np.zeros((count, self._width[table]), dtype=np.float32)
        for part, where, of in parts:
            for feature, columns in self._columns[table]:
                if feature.of not in of:
                    continue
                if isinstance(part, Selection) or feature.layout is None:
                    found = np.asarray(feature.compute(part))
                    values[where, columns] = found if found.ndim == 2 else found.reshape(-1, 1)
                else:
                    values[where, columns] = feature.layout
        return values

    def _compute_evidence(
        self, table: Literal["place", "question"], selected: Selection
    ) -> np.ndarray | None:
        """Compute what the memory says of places or questions, (n, D); None if that is off."""
        if not self._columns[table]:
            return None
        values = self._compute(table, len(selected.rows), (selected, slice(None), (table,)))
        names = PLACE_COLUMNS if table == "place" else QUESTION_COLUMNS
        for feature, columns in self._columns[table]:
            if feature.group == "evidence":
                values[:, columns] *= [self.config.shows(name) for name in names]
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
        """Mark the places where each query object may be, bool (NF, relations)."""
        if self.config.candidates == "random":
            counts = np.diff(snapshots.find_first("furniture"))
            return sample_places(counts, self.config.random_candidates, rng=self._rng)
        if self.config.candidates == "all":  # as `choose_edges` of the evidence
            likelier = choose_relations(snapshots.query_prior, last=True)
            return likelier[:, None] == np.arange(NUM_RELATIONS)
        return propose_rows(
            snapshots.query_prior,
            snapshots.furniture["snapshot"],
            snapshots.num_snapshots,
            self.config.threshold,
        )


def _list_targets(snapshots: Snapshots, asked: Selection) -> dict[str, np.ndarray | None]:
    """Return what is to be learnt of the Q query edges, by its name in a batch."""
    target = np.full(len(asked.rows), np.nan, dtype=np.float32)
    if snapshots.answers is not None:
        target[:] = snapshots.answers[asked["furniture"]]
    has_relevance = "relevance" in snapshots.extras
    relevance = asked.extra("relevance").astype(np.float32) if has_relevance else None
    return {"query_target": target, "query_relevance": relevance}

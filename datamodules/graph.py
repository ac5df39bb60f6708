"""Snapshots to the graph of a batch, built once per batch."""

from __future__ import annotations

import numpy as np

from datamodules.batch import MAX_ENTERING, NODE_TEMPORAL_DIM, TEXT_DIM, SGMBatch
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
    take_evidence,
)
from datamodules.graph_arrays import GraphArrays
from datamodules.object_edges import ObjectEdges
from datamodules.pairs import FIRST_OBJECT_TYPE, OBJECT_UP, Pairs
from sgm.memory.candidates import propose_rows, sample_places
from sgm.memory.columns import NEVER
from sgm.text import load_text
from simulator.snapshots.snapshots import Snapshots, forget, forget_absence


class GraphBuilder:
    """Turns snapshots into batches for a model.

    Concatenates arrays, offsets ids and builds one graph: no object per snapshot, node or edge.
    """

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
        self._rng = np.random.default_rng(seed)
        self._text = load_text(config.text_pipeline)
        self._labels: tuple[str, ...] = ()
        # No tensors: those made while a network plays, in inference mode, cannot be trained on.
        self._table = (np.zeros((0, TEXT_DIM), np.float32), np.zeros((0, 0), np.float32))

    def build(self, snapshots: Snapshots) -> SGMBatch:
        """Build the batch of B snapshots."""
        return self.build_arrays(snapshots).make_batch()

    def build_arrays(self, snapshots: Snapshots) -> GraphArrays:
        """Build the same as flat arrays: for a single home, a DGL graph takes longer to make."""
        if not self.config.memory:
            snapshots = forget(snapshots)
        if not self.config.absence:
            snapshots = forget_absence(snapshots)
        text, cosine = self._get_text(snapshots.labels)
        is_all = self.config.candidates == "all"
        edges = ObjectEdges.from_snapshots(snapshots, self._propose(snapshots), is_all)
        pairs = Pairs.from_snapshots(snapshots, edges)
        kept = pairs.keep_all() if self.num_hops is None else pairs.keep_hops(edges, self.num_hops)
        node = np.flatnonzero(kept.nodes)
        first_node = np.searchsorted(node, pairs.first_node).tolist()
        src, dst, pair, first_edge = pairs.list_edges(kept)

        _, _, _, furniture, objects, _ = pairs.first_node.tolist()
        place = node[first_node[3] : first_node[4]] - furniture
        temporal = np.zeros((len(node), NODE_TEMPORAL_DIM * self.config.temporal), dtype=np.float32)
        if self.config.temporal:
            temporal[first_node[3] : first_node[4]] = compute_furniture_temporal(snapshots, place)
            temporal[first_node[4] :] = compute_object_temporal(
                snapshots, node[first_node[4] :] - objects
            )
        num_layout = first_edge[FIRST_OBJECT_TYPE]
        number = pairs.object_edge[pair[num_layout:] - pairs.num_layout]
        feature = _compute_features(
            snapshots,
            edges,
            number,
            pair[:num_layout] - pairs.first_pair[2],
            cosine[pairs.label[src], pairs.label[dst]],
        )
        drop_features(feature, self.config)

        upward = slice(first_edge[OBJECT_UP.start], first_edge[OBJECT_UP.stop])
        candidate = number[upward.start - num_layout : upward.stop - num_layout]
        is_query = np.flatnonzero(edges.is_query[candidate])
        query_edge, candidate = is_query + upward.start, candidate[is_query]
        asked, furniture_row = edges.snapshot[candidate], edges.furniture[candidate]
        target = np.full(len(candidate), np.nan, dtype=np.float32)
        if snapshots.answers is not None:
            target[:] = snapshots.answers[furniture_row]
        relevance = snapshots.extras.get("relevance")
        if relevance is not None:
            relevance = relevance[furniture_row].astype(np.float32)
        if self.config.belief:
            feature = _append_belief(snapshots, feature, query_edge, furniture_row)
        if self.config.clock:
            feature = _append_clock(snapshots, feature, edges, number)
        evidence = question = None
        if self.config.evidence:
            evidence, question = take_evidence(snapshots, self.config)
            evidence = evidence[place]
        number_of_node = np.cumsum(kept.nodes) - 1
        degrees = np.zeros((len(node), MAX_ENTERING), dtype=np.float32)
        if self.num_hops != 0:
            degrees = pairs.compute_degrees()[node]
        first_furniture, node_snapshot = snapshots.first_furniture, pairs.snapshot[node]
        return GraphArrays(
            first_node=first_node,
            first_edge=first_edge.tolist(),
            label=pairs.label[node],
            temporal=temporal,
            degree=np.einsum("nd->n", degrees),  # three columns: `sum` takes a call a node
            degrees=degrees,
            node_snapshot=node_snapshot,
            furniture_index=place - first_furniture[node_snapshot[first_node[3] : first_node[4]]],
            edge_src=number_of_node[src],
            edge_dst=number_of_node[dst],
            edge_feature=feature,
            query_edge=query_edge,
            query_snapshot=asked,
            query_furniture=furniture_row - first_furniture[asked],
            query_relation=edges.relation[candidate],
            query_target=target,
            query_relevance=relevance,
            evidence=evidence,
            question=question,
            text=text,
            num_snapshots=snapshots.num_snapshots,
        )

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
        return self.num_hops == 0 and not self.config.temporal

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
            snapshots.query_prior,
            snapshots.furniture_snapshot,
            snapshots.num_snapshots,
            self.config.threshold,
        )


def _compute_features(
    snapshots: Snapshots,
    edges: ObjectEdges,
    number: np.ndarray,
    layout: np.ndarray,
    cosine: np.ndarray,
) -> np.ndarray:
    """Compute the features of all edges, those of the layout first, float32 (E, 9).

    Args:
        snapshots: the snapshots.
        edges: the object edges.
        number: which of them each edge is that is none of the layout.
        layout: row of the furniture node that each edge of the layout joins to its room; negative
            for edges between rooms, floor and home, which are certain.
        cosine: of the text vectors of each edge's two nodes, (E,).
    """
    features = np.empty((len(cosine), 9), dtype=np.float32)
    prob = np.where(layout < 0, 1.0, snapshots.furniture_prob[np.maximum(layout, 0)])
    first = len(layout)
    features[:first] = compute_layout_features(prob, cosine[:first])
    is_remembered = number < edges.num_remembered
    rows, chosen = np.flatnonzero(is_remembered) + first, number[is_remembered]
    features[rows] = compute_edge_features(snapshots, chosen, cosine[rows])
    is_hypothetical = ~is_remembered
    rows, chosen = np.flatnonzero(is_hypothetical) + first, number[is_hypothetical]
    prior = snapshots.query_prior[edges.furniture[chosen], edges.relation[chosen]]
    features[rows] = compute_hypothetical_features(
        snapshots.time[edges.snapshot[chosen]], prior, cosine[rows]
    )
    return features


def _append_belief(
    snapshots: Snapshots,
    feature: np.ndarray,
    query_edge: np.ndarray,
    furniture_row: np.ndarray,
) -> np.ndarray:
    """Append the belief features of query edges, zero for other edges, (E, 9) -> (E, 14).

    Raises:
        ValueError: if the snapshots hold no belief.
    """
    if "belief" not in snapshots.extras:
        raise ValueError(
            "snapshots must hold a belief for `features.belief`, got none. Collect with "
            "`--belief`, or switch the feature off."
        )
    columns = np.zeros((len(feature), BELIEF_DIM), dtype=np.float32)
    columns[query_edge] = compute_belief_features(snapshots.extras["belief"][furniture_row])
    return np.concatenate([feature, columns], axis=1)


def _append_clock(
    snapshots: Snapshots, feature: np.ndarray, edges: ObjectEdges, number: np.ndarray
) -> np.ndarray:
    """Append the clock features of edges of objects, zero for the layout, (E, D) -> (E, D + 8).

    Args:
        snapshots: the snapshots.
        feature: of all edges, those of the layout first.
        edges: the object edges.
        number: which of them each edge is that is none of the layout.

    Raises:
        ValueError: if it is not known of every snapshot what time it was.
    """
    clock = require_clock(snapshots.clock)
    never = np.full(len(edges.snapshot) - edges.num_remembered, NEVER)
    last_true = np.concatenate([snapshots.edge_last_true, never])[number]
    snapshot = edges.snapshot[number]
    columns = np.zeros((len(feature), CLOCK_DIM), dtype=np.float32)
    columns[len(feature) - len(number) :] = compute_clock_features(
        clock[snapshot], snapshots.time[snapshot], last_true
    )
    return np.concatenate([feature, columns], axis=1)

"""The graph of a batch of snapshots as flat arrays, and the DGL graph made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
import torch

from datamodules.batch import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES, SGMBatch
from datamodules.heterograph import make_heterograph

_Type = TypeVar("_Type", str, tuple[str, str, str])


@dataclass(frozen=True, slots=True)
class GraphArrays:
    """Nodes of all types in one row of ids, edges of all types in one list.

    Nodes lie in the order of `NODE_TYPES`, edges in the order of `EDGE_TYPES`, each type
    contiguous. Query edges ascend, which is the query order of `SGMBatch`.

    Attributes:
        first_node: first id of each node type and, last, N: 6 of them.
        first_edge: first id of each edge type and, last, E: 11 of them.
        label: int64 (N,), row of `text`.
        temporal: float32 (N, 4); (N, 0) for a model that reads none.
        degree: in-degree of the graph before pruning, float32 (N,); 0 for a model without
            convolutions.
        degrees: the same for each edge type that enters a node, float32 (N, 3), see `SGMBatch`.
        node_snapshot: 0..B-1, ascending within each node type, int64 (N,).
        furniture_index: place within its home of each furniture node, int64.
        edge_src, edge_dst: node ids, int64 (E,).
        edge_feature: float32 (E, 9 to 22), see `SGMBatch`.
        query_edge: edge id of each query edge, int64 (Q,).
        query_snapshot: whose query edge it is, 0..B-1, int64 (Q,).
        query_furniture: place within the home that it leads to, int64 (Q,).
        query_relation: 0 "in", 1 "onTop", int64 (Q,).
        query_target: 1 or 0, nan where unknown, float32 (Q,).
        query_relevance: of its place, float32 (Q,); None where nobody said.
        evidence: what the memory says about each furniture node, float32 (NF, EVIDENCE_DIM); None
            where the model reads none.
        question: what it says about each question, float32 (B, QUESTION_DIM), or None.
        text: float32 (L, 96), one text vector per label; (L, 0) for a model that reads none.
        num_snapshots: B.
    """

    first_node: list[int]
    first_edge: list[int]
    label: np.ndarray
    temporal: np.ndarray
    degree: np.ndarray
    degrees: np.ndarray
    node_snapshot: np.ndarray
    furniture_index: np.ndarray
    edge_src: np.ndarray
    edge_dst: np.ndarray
    edge_feature: np.ndarray
    query_edge: np.ndarray
    query_snapshot: np.ndarray
    query_furniture: np.ndarray
    query_relation: np.ndarray
    query_target: np.ndarray
    query_relevance: np.ndarray | None
    evidence: np.ndarray | None
    question: np.ndarray | None
    text: np.ndarray
    num_snapshots: int

    def make_batch(self) -> SGMBatch:
        """Make the DGL graph: the same numbers, per node type and edge type."""
        nodes = {
            ntype: slice(*ends)
            for ntype, ends in zip(NODE_TYPES, pairwise(self.first_node), strict=True)
        }
        edges = {
            etype: slice(*ends)
            for etype, ends in zip(EDGE_TYPES, pairwise(self.first_edge), strict=True)
        }
        columns = {
            "label": torch.from_numpy(self.label),
            "temporal": torch.from_numpy(self.temporal),
            "degree": torch.from_numpy(self.degree),
            "degrees": torch.from_numpy(self.degrees),
            "snapshot": torch.from_numpy(self.node_snapshot),
        }
        node_data = {
            ntype: {name: column[rows] for name, column in columns.items()}
            for ntype, rows in nodes.items()
        }
        node_data["furniture"]["index"] = torch.from_numpy(self.furniture_index)
        if self.evidence is not None:
            node_data["furniture"]["evidence"] = torch.from_numpy(self.evidence)
        feature = torch.from_numpy(self.edge_feature)
        edge_data = {etype: {"feature": feature[rows]} for etype, rows in edges.items()}
        for name, values in self._spread_queries().items():
            for etype in QUERY_EDGE_TYPES:
                edge_data[etype][name] = torch.from_numpy(values[edges[etype]])
        graph = make_heterograph(
            {
                (src, relation, dst): (
                    torch.from_numpy(self.edge_src[rows] - nodes[src].start),
                    torch.from_numpy(self.edge_dst[rows] - nodes[dst].start),
                )
                for (src, relation, dst), rows in edges.items()
            },
            {ntype: rows.stop - rows.start for ntype, rows in nodes.items()},
            node_data,
            edge_data,
        )
        graph.set_batch_num_nodes(_name(NODE_TYPES, self._count_nodes()))
        graph.set_batch_num_edges(_name(EDGE_TYPES, self._count_edges()))
        question = None if self.question is None else torch.from_numpy(self.question)
        return SGMBatch(graph, torch.from_numpy(self.text), self.num_snapshots, question)

    def _count_nodes(self) -> np.ndarray:
        """Count the nodes of each type and snapshot, (5, B)."""
        return _count_blocks(self.node_snapshot, self.first_node, self.num_snapshots)

    def _count_edges(self) -> np.ndarray:
        """Count the edges of each type and snapshot, (10, B)."""
        snapshot = self.node_snapshot[self.edge_dst]
        return _count_blocks(snapshot, self.first_edge, self.num_snapshots)

    def _spread_queries(self) -> dict[str, np.ndarray]:
        """Give every edge what query edges have; -1, nan and 0 where it is none, (E,) each."""
        num_edges = self.first_edge[-1]
        columns = {
            "query": np.full(num_edges, -1),
            "target": np.full(num_edges, np.nan, dtype=np.float32),
        }
        columns["query"][self.query_edge] = self.query_snapshot
        columns["target"][self.query_edge] = self.query_target
        if self.query_relevance is not None:
            columns["relevance"] = np.zeros(num_edges, dtype=np.float32)
            columns["relevance"][self.query_edge] = self.query_relevance
        return columns


def _count_blocks(snapshot: np.ndarray, first: list[int], num_snapshots: int) -> np.ndarray:
    """Count the entries of each snapshot in each block, (n,) -> (blocks, B)."""
    blocks = (snapshot[start:end] for start, end in pairwise(first))
    return np.stack([np.bincount(block, minlength=num_snapshots) for block in blocks])


def _name(types: Sequence[_Type], counts: np.ndarray) -> dict[_Type, torch.Tensor]:
    return dict(zip(types, torch.from_numpy(counts), strict=True))

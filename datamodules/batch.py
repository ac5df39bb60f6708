"""The batch of snapshots that the models read, and the names of its graph schema."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import dgl
import torch
from torch import Tensor

if TYPE_CHECKING:
    from torch_geometric.data import HeteroData

NODE_TYPES = ("house", "floor", "room", "furniture", "object")
RELATIONS = ("in", "contains", "onTop", "under")
EDGE_TYPES = (
    ("house", "contains", "floor"),
    ("floor", "in", "house"),
    ("floor", "contains", "room"),
    ("room", "in", "floor"),
    ("room", "contains", "furniture"),
    ("furniture", "in", "room"),
    ("furniture", "contains", "object"),
    ("object", "in", "furniture"),
    ("object", "onTop", "furniture"),
    ("furniture", "under", "object"),
)
# The edge types that enter each node type: the columns of its `degrees`.
ENTERING = {
    ntype: tuple(etype for etype in EDGE_TYPES if etype[2] == ntype) for ntype in NODE_TYPES
}
MAX_ENTERING = 3
QUERY_EDGE_TYPES = (("object", "in", "furniture"), ("object", "onTop", "furniture"))

TEXT_DIM = 96
NODE_TEMPORAL_DIM = 4
EDGE_FEATURE_DIM = 9


@dataclass(frozen=True, slots=True)
class SGMBatch:
    """B scene graph memory snapshots as one heterogeneous graph.

    Query order: the edges of (object, in, furniture) with `query` >= 0 in edge order, then those of
    (object, onTop, furniture). Models give one logit per query edge in this order.

    Attributes:
        graph: has all of `NODE_TYPES` and `EDGE_TYPES`, empty ones included. It knows its
            snapshots as a graph of `dgl.batch` does: `batch_num_nodes`, `dgl.unbatch` and DGL's
            readouts work; nodes and edges of each type lie snapshot by snapshot. It may be pruned
            to the k-hop in-neighbourhood of the query edges' end nodes. Node data of every type:
            `label` int64 (N,), row of `text`; `temporal` float32 (N, 4), scaled: time since
            observed, times observed, time since moved, move frequency, (N, 0) for a model that
            reads none; `snapshot` int64 (N,), 0..B-1; `degree` float32 (N,), in-degree before
            pruning, and `degrees` float32 (N, 3), the same by edge type: the types of `ENTERING`
            for the node type, in that order; 0 for a model without convolutions. Edge data of
            every type: `feature` float32 (E, 9), scaled: cosine, time since observed, time since
            changed, times observed, times true, frequency true, times changed, last state, prior;
            then, if the model reads them, 5 belief and 8 clock features (`FeatureConfig`). Edge
            data of `QUERY_EDGE_TYPES` also: `query` int64 (E,), the snapshot 0..B-1 whose query
            edge it is, or -1; `target` float32 (E,), 1 or 0 for query edges whose truth is known,
            else nan; and, where the task says how relevant a place is, `relevance` float32 (E,) of
            the place of each query edge.
        text: float32 (L, 96), one text vector per label; (L, 0) for a model that reads none.
        num_snapshots: B.
        question: what the memory says about each question, float32 (B, QUESTION_DIM), with
            `features.evidence`; then furniture nodes have `evidence`, float32 (N, EVIDENCE_DIM).

    Source: paper section 4.2, appendix B.
    """

    graph: dgl.DGLGraph
    text: Tensor
    num_snapshots: int
    question: Tensor | None = None

    def to_pyg(self) -> HeteroData:
        """Return the batch as PyTorch Geometric's `HeteroData`, extra `events`.

        Nodes, edges and their data keep their names; `edge_index` has source and destination, and
        `batch` of every node type is the snapshot of each node, by which PyG pools.

        Raises:
            ModuleNotFoundError: if torch_geometric is not installed.
        """
        from torch_geometric.data import HeteroData

        data = HeteroData()
        for ntype in self.graph.ntypes:
            store = data[ntype]
            store.num_nodes = self.graph.num_nodes(ntype)
            for name, values in self.graph.nodes[ntype].data.items():
                store[name] = values
            store.batch = self.graph.nodes[ntype].data["snapshot"]
        for etype in self.graph.canonical_etypes:
            store = data[etype]
            store.edge_index = torch.stack(self.graph.edges(etype=etype, order="eid")).long()
            for name, values in self.graph.edges[etype].data.items():
                store[name] = values
        data.text, data.num_snapshots = self.text, self.num_snapshots
        if self.question is not None:
            data.question = self.question
        return data

    def to(self, device: Any, **kwargs: Any) -> SGMBatch:
        """Copy the batch to a device; keyword arguments are those of `dgl.DGLGraph.to`."""
        return replace(
            self,
            graph=self.graph.to(device, **kwargs),
            text=self.text.to(device, **kwargs),
            question=None if self.question is None else self.question.to(device, **kwargs),
        )

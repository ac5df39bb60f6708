"""The batch of snapshots that models read: flat arrays, and the graph of a library on request."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from importlib import import_module
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from sgm.schema import EDGE_TYPES, NODE_TYPES
from simulator.snapshots.type_numbers import FURNITURE, OBJECT_UP

if TYPE_CHECKING:
    import dgl
    from torch_geometric.data import HeteroData


@dataclass(frozen=True)
class Batch:
    """B scene graph memory snapshots: nodes of all types in one row of ids, edges in one list.

    Ten relations times a handful of kernels cost more than the arithmetic at the size of a scene
    graph, so all types lie in the same arrays and layers use index operations on them. Nodes lie in
    the order of `NODE_TYPES`, edges in the order of `EDGE_TYPES`, each type contiguous and snapshot
    by snapshot. The graph may be pruned to the k-hop in-neighbourhood of the query edges' end
    nodes. Query edges ascend; models give one logit for each, in this order.

    Attributes:
        node_counts: number of nodes per node type, 5 of them.
        edge_counts: number of edges per edge type, 10 of them.
        label: row of `text` of each node, int64 (N,).
        node_feature: features of each node (`FEATURES`), float32 (N, 4 or more); (N, 0) for a model
            that reads none.
        degrees: in-degree before pruning by edge type, the types of `ENTERING` for the node's own,
            float32 (N, 3); 0 for a model without convolutions.
        node_snapshot: 0..B-1, ascending within each node type, int64 (N,).
        furniture_index: place within its home of each furniture node, int64 (NF,).
        edge_src, edge_dst: node ids, int64 (E,).
        edge_feature: features of each edge (`FEATURES`), float32 (E, 9 or more).
        query_edge: edge id of each query edge, int64 (Q,).
        query_snapshot: whose query edge it is, 0..B-1, int64 (Q,).
        query_target: 1 or 0, nan where the truth is unknown, float32 (Q,).
        query_relevance: how relevant its place is, float32 (Q,); None where the task does not say.
        evidence: what the memory says about each furniture node, with `FeatureConfig.evidence`,
            float32 (NF, EVIDENCE_DIM), else None.
        question: what it says about each question, float32 (B, QUESTION_DIM), or None.
        text: one text vector per label, float32 (L, 96); (L, 0) for a model that reads none.
        num_snapshots: B.

    Source: paper section 4.2, appendix B.
    """

    node_counts: tuple[int, ...]
    edge_counts: tuple[int, ...]
    label: Tensor
    node_feature: Tensor
    degrees: Tensor
    node_snapshot: Tensor
    furniture_index: Tensor
    edge_src: Tensor
    edge_dst: Tensor
    edge_feature: Tensor
    query_edge: Tensor
    query_snapshot: Tensor
    query_target: Tensor
    query_relevance: Tensor | None
    evidence: Tensor | None
    question: Tensor | None
    text: Tensor
    num_snapshots: int

    @cached_property
    def graph(self) -> dgl.DGLGraph:
        """The batch as a heterogeneous DGL graph, made when it is first read.

        It has all of `NODE_TYPES` and `EDGE_TYPES`, empty ones included, and knows its snapshots as
        a graph of `dgl.batch` does: `batch_num_nodes`, `dgl.unbatch` and DGL's readouts work.

        Node data of every type are `label`, `temporal` (`node_feature`), `degree`, `degrees` and
        `snapshot`, as the attributes of the batch; of furniture also `index` and, where it is
        there, `evidence`. Edge data of every type are `feature`; of `QUERY_EDGE_TYPES` also
        `query`, the snapshot whose query edge it is, or -1; `target`, 1 or 0 for query edges whose
        truth is known, else nan; and, where the task says it, `relevance` of the place of each
        query edge.

        Raises:
            ModuleNotFoundError: if DGL is not installed, which has no wheels beyond Python 3.11;
                `to_pyg` makes the same graph.
        """
        made: dgl.DGLGraph = import_module("datamodules.dgl_graphs").make_heterogeneous(self)
        return made

    @cached_property
    def homogeneous(self) -> dgl.DGLGraph:
        """The graph that encoders read: all nodes and edges as in the arrays, types as ids.

        As `dgl.to_homogeneous(batch.graph)`, without that detour: `ndata["_TYPE"]` counts in
        `NODE_TYPES`, `edata["_TYPE"]` in `EDGE_TYPES`, and `ndata["degree"]` is `degree`. Without
        DGL, or on a device for which it was not built, it is a `GraphStandIn`.
        """
        made: dgl.DGLGraph = import_module("datamodules.dgl_graphs").make_homogeneous(self)
        return made

    @cached_property
    def node_type(self) -> Tensor:
        """Type of each node, by number in `NODE_TYPES`, int64 (N,)."""
        return _repeat(self.node_counts, self.label.device)

    @cached_property
    def edge_type(self) -> Tensor:
        """Type of each edge, by number in `EDGE_TYPES`, int64 (E,)."""
        return _repeat(self.edge_counts, self.label.device)

    def to_pyg(self) -> HeteroData:
        """Return the batch as PyTorch Geometric's `HeteroData`, extra `events`.

        Nodes, edges and their data have the names that they have in `graph`; `edge_index` has
        source and destination, and `batch` of every node type is the snapshot of each node, by
        which PyG pools.

        Raises:
            ModuleNotFoundError: if torch_geometric is not installed.
        """
        made: HeteroData = import_module("datamodules.pyg_graph").make_pyg(self)
        return made

    @property
    def first_node(self) -> dict[str, int]:
        """Id of the first node of each node type."""
        starts = accumulate(self.node_counts, initial=0)
        return dict(zip(NODE_TYPES, starts, strict=False))

    def split_nodes(self, values: Tensor) -> dict[str, Tensor]:
        """Share rows of nodes out to their types: (N, ...) -> (n, ...) each."""
        return dict(zip(NODE_TYPES, values.split(self.node_counts), strict=True))

    def split_edges(self, values: Tensor) -> dict[tuple[str, str, str], Tensor]:
        """Share rows of edges out to their types: (E, ...) -> (n, ...) each."""
        return dict(zip(EDGE_TYPES, values.split(self.edge_counts), strict=True))

    def to(self, device: torch.device, dtype: torch.dtype | None = None) -> Batch:
        """Copy the tensors to a device; on the same device it is this batch.

        A DGL graph that was made already stays where it is, unless types change: moving it takes a
        build of DGL for the device, which only an encoder that reads it needs.

        Args:
            device: where to.
            dtype: of all floating-point tensors; None to keep theirs.
        """
        stays = self.label.device == device
        if stays and dtype in (None, self.node_feature.dtype):
            return self
        tensors: dict[str, Any] = {
            field.name: value.to(device, dtype if value.is_floating_point() else None)
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), Tensor)
            and (value.is_floating_point() or not stays)
        }
        moved = replace(self, **tensors)
        if "graph" in self.__dict__ and moved.text.dtype == self.text.dtype:
            moved.__dict__["graph"] = self.graph
        return moved

    @property
    def num_nodes(self) -> int:
        """N."""
        return sum(self.node_counts)

    @property
    def num_edges(self) -> int:
        """E."""
        return sum(self.edge_counts)

    @property
    def degree(self) -> Tensor:
        """In-degree of each node before pruning, (N,)."""
        return self.degrees.sum(dim=1)

    @property
    def furniture(self) -> slice:
        """The furniture nodes among all."""
        first = self.first_node["furniture"]
        return slice(first, first + self.node_counts[FURNITURE])

    @property
    def query_furniture(self) -> Tensor:
        """Place within the home that each query edge leads to, int64 (Q,)."""
        return self.furniture_index[self.edge_dst[self.query_edge] - self.furniture.start]

    @property
    def query_relation(self) -> Tensor:
        """Relation of each query edge, by number in `RELATIONS`, int64 (Q,)."""
        relation = torch.zeros_like(self.query_edge)
        for edge_type in range(OBJECT_UP.start + 1, OBJECT_UP.stop):
            relation += self.query_edge >= sum(self.edge_counts[:edge_type])
        return relation


def _repeat(counts: tuple[int, ...], device: torch.device) -> Tensor:
    """Return the number of each block, as often as it has rows."""
    each = torch.tensor(counts, device=device)
    return torch.repeat_interleave(each, output_size=sum(counts))

"""One flat view of a batched heterogeneous graph, on which all layers work."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import accumulate, pairwise
from typing import Any

import dgl
import torch
from torch import Tensor

from datamodules.batch import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES, SGMBatch
from datamodules.graph_arrays import GraphArrays

_FURNITURE = NODE_TYPES.index("furniture")


@dataclass(frozen=True, slots=True)
class FlatGraph:
    """Nodes of all types in one row of ids, edges of all types in one list.

    Ten relations times a handful of DGL kernels cost more than the arithmetic at the size of a
    scene graph, so the relations are concatenated once here and the layers use index operations
    on the result. Nodes lie in the order of `NODE_TYPES`, edges in the order of `EDGE_TYPES`,
    each type contiguous.

    Attributes:
        node_counts: number of nodes per node type, 5 of them.
        edge_counts: number of edges per edge type, 10 of them.
        label: (N,) int64 row of `text`.
        temporal: (N, 4) node features; (N, 0) for a model that reads none.
        degree: (N,) in-degree of the graph before pruning.
        node_snapshot: (N,) int64 in 0..B-1, ascending within each node type.
        edge_src: (E,) int64 node id.
        edge_dst: (E,) int64 node id.
        edge_feature: (E, 9 to 22), see `SGMBatch`.
        query_edge: (Q,) int64 edge id of each query edge, in query order.
        query_snapshot: (Q,) int64 in 0..B-1.
        query_target: (Q,) 1, 0, or nan where unknown.
        query_relevance: (Q,) of the place of each query edge; None where the task does not say.
        evidence: (NF, EVIDENCE_DIM) of the furniture nodes; None where the model reads none.
        question: (B, QUESTION_DIM), or None.
        text: (L, 96) or (L, 0), see `SGMBatch`.
        num_snapshots: B.
        heterograph: the DGL graph that all this was taken from, on the device where it was made;
            None for a graph that was never made.
    """

    node_counts: tuple[int, ...]
    edge_counts: tuple[int, ...]
    label: Tensor
    temporal: Tensor
    degree: Tensor
    node_snapshot: Tensor
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
    heterograph: dgl.DGLGraph | None = None

    @classmethod
    def from_batch(cls, batch: SGMBatch) -> FlatGraph:
        """Concatenate the node and edge types of `batch`.

        Raises:
            ValueError: if the graph's node or edge types are not those of the schema.
        """
        graph = batch.graph
        for what, want, got in (
            ("node types", NODE_TYPES, graph.ntypes),
            ("edge types", EDGE_TYPES, graph.canonical_etypes),
        ):
            if set(got) != set(want):
                raise ValueError(
                    f"{what} of a batch must be {sorted(want)}, got {sorted(got)}. "
                    "Give the graph the full schema, empty types included."
                )
        node_counts = tuple(graph.num_nodes(ntype) for ntype in NODE_TYPES)
        first_node = dict(
            zip(NODE_TYPES, accumulate(node_counts, initial=0), strict=False)
        )  # the running sum has one entry more: the total
        edge_counts = tuple(graph.num_edges(etype) for etype in EDGE_TYPES)
        first_edge = dict(zip(EDGE_TYPES, accumulate(edge_counts, initial=0), strict=False))

        edge_src, edge_dst = [], []
        for etype in EDGE_TYPES:
            src, dst = graph.edges(etype=etype, order="eid")
            edge_src.append(src.long() + first_node[etype[0]])
            edge_dst.append(dst.long() + first_node[etype[2]])

        query_edge, query_snapshot, query_target, query_relevance = [], [], [], []
        for etype in QUERY_EDGE_TYPES:
            data = graph.edges[etype].data
            marked = torch.nonzero(data["query"] >= 0).squeeze(1)
            query_edge.append(marked + first_edge[etype])
            query_snapshot.append(data["query"][marked])
            query_target.append(data["target"][marked])
            if "relevance" in data:
                query_relevance.append(data["relevance"][marked])

        return cls(
            node_counts=node_counts,
            edge_counts=edge_counts,
            label=_join_nodes(graph, "label"),
            temporal=_join_nodes(graph, "temporal"),
            degree=_join_nodes(graph, "degree"),
            node_snapshot=_join_nodes(graph, "snapshot"),
            edge_src=torch.cat(edge_src),
            edge_dst=torch.cat(edge_dst),
            edge_feature=torch.cat([graph.edges[etype].data["feature"] for etype in EDGE_TYPES]),
            query_edge=torch.cat(query_edge),
            query_snapshot=torch.cat(query_snapshot),
            query_target=torch.cat(query_target),
            query_relevance=torch.cat(query_relevance) if query_relevance else None,
            evidence=graph.nodes["furniture"].data.get("evidence"),
            question=batch.question,
            text=batch.text,
            num_snapshots=batch.num_snapshots,
            heterograph=graph,
        )

    @classmethod
    def from_arrays(cls, arrays: GraphArrays) -> FlatGraph:
        """Take over arrays: equal to `from_batch(arrays.make_batch())`, with no DGL graph made."""
        relevance = arrays.query_relevance
        return cls(
            node_counts=_count(arrays.first_node),
            edge_counts=_count(arrays.first_edge),
            label=torch.from_numpy(arrays.label),
            temporal=torch.from_numpy(arrays.temporal),
            degree=torch.from_numpy(arrays.degree),
            node_snapshot=torch.from_numpy(arrays.node_snapshot),
            edge_src=torch.from_numpy(arrays.edge_src),
            edge_dst=torch.from_numpy(arrays.edge_dst),
            edge_feature=torch.from_numpy(arrays.edge_feature),
            query_edge=torch.from_numpy(arrays.query_edge),
            query_snapshot=torch.from_numpy(arrays.query_snapshot),
            query_target=torch.from_numpy(arrays.query_target),
            query_relevance=None if relevance is None else torch.from_numpy(relevance),
            evidence=None if arrays.evidence is None else torch.from_numpy(arrays.evidence),
            question=None if arrays.question is None else torch.from_numpy(arrays.question),
            text=torch.from_numpy(arrays.text),
            num_snapshots=arrays.num_snapshots,
        )

    def to(self, device: torch.device, dtype: torch.dtype | None = None) -> FlatGraph:
        """Copy the tensors to a device; on the same device it is this graph.

        The DGL graph stays where it is: moving it takes a build of DGL for the device, which only
        an encoder that reads it needs.

        Args:
            device: where to.
            dtype: of all floating-point tensors; None to keep theirs.
        """
        stays = self.label.device == device
        if stays and dtype in (None, self.temporal.dtype):
            return self
        tensors: dict[str, Any] = {
            field.name: value.to(device, dtype if value.is_floating_point() else None)
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), Tensor)
            and (value.is_floating_point() or not stays)
        }
        return replace(self, **tensors)

    @property
    def num_nodes(self) -> int:
        """N."""
        return sum(self.node_counts)

    @property
    def furniture(self) -> slice:
        """The furniture nodes among all."""
        first = sum(self.node_counts[:_FURNITURE])
        return slice(first, first + self.node_counts[_FURNITURE])

    @property
    def num_edges(self) -> int:
        """E."""
        return sum(self.edge_counts)

    def find_entered(self) -> tuple[Tensor, Tensor]:
        """Find the nodes that edges enter, (R,), and which of them each edge enters, (E,)."""
        is_entered = self.edge_dst.new_zeros(self.num_nodes).index_fill_(0, self.edge_dst, 1)
        number = is_entered.cumsum(0) - 1
        return is_entered.nonzero().squeeze(1), number.index_select(0, self.edge_dst)

    def repeat_per_edge_type(self, values: Tensor) -> Tensor:
        """Give each edge the row of its edge type: (10, ...) -> (E, ...)."""
        return _repeat_blocks(values, self.edge_counts)

    def repeat_per_node_type(self, values: Tensor) -> Tensor:
        """Give each node the row of its node type: (5, ...) -> (N, ...)."""
        return _repeat_blocks(values, self.node_counts)

    def project_per_node_type(
        self, node: Tensor, weight: Tensor, bias: Tensor | None = None
    ) -> Tensor:
        """Multiply each node by the matrix of its type: (N, C), (5, C, D), (5, D) -> (N, D)."""
        rows = enumerate(node.split(self.node_counts))
        # of a single home two blocks are empty; one stays, since all may be
        blocks = [(number, block) for number, block in rows if len(block) or not number]
        if bias is None:
            return torch.cat([block @ weight[number] for number, block in blocks])
        return torch.cat([torch.addmm(bias[n], block, weight[n]) for n, block in blocks])


def _join_nodes(graph: dgl.DGLGraph, name: str) -> Tensor:
    return torch.cat([graph.nodes[ntype].data[name] for ntype in NODE_TYPES])


def _count(first: list[int]) -> tuple[int, ...]:
    return tuple(end - start for start, end in pairwise(first))


def _repeat_blocks(values: Tensor, counts: tuple[int, ...]) -> Tensor:
    # The backward of expand is a sum per block, that of repeat_interleave a slow scatter. Of a
    # single home most blocks are empty: they are left out but for one, since all may be empty.
    blocks = [(row, count) for row, count in enumerate(counts) if count or not row]
    return torch.cat([values[row].expand(count, *values.shape[1:]) for row, count in blocks])

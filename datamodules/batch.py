"""The batch of snapshots that the models read, and the names of its graph schema."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import dgl
from torch import Tensor

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
        graph: has all of `NODE_TYPES` and `EDGE_TYPES`, empty ones included. It may be pruned to
            the k-hop in-neighbourhood of the query edges' end nodes. Node data of every type:
            `label` int64 (N,), row of `text`; `temporal` float32 (N, 4), scaled: time since
            observed, times observed, time since moved, move frequency; `degree` float32 (N,),
            in-degree before pruning. Edge data of every type: `feature` float32 (E, 9), scaled:
            cosine, time since observed, time since changed, times observed, times true, frequency
            true, times changed, last state, prior; then, if the model reads them, 5 belief and 8
            clock features (`FeatureConfig`). Edge data of `QUERY_EDGE_TYPES` also: `query`
            int64 (E,), the snapshot 0..B-1 whose query edge it is, or -1; `target` float32 (E,),
            1 or 0 for query edges whose truth is known, else nan; and, where the task grades
            places, `grade` float32 (E,), what the place of each query edge is worth.
        text: float32 (L, 96), one text vector per label.
        num_snapshots: B.

    Source: paper section 4.2, appendix B.
    """

    graph: dgl.DGLGraph
    text: Tensor
    num_snapshots: int

    def to(self, device: Any, **kwargs: Any) -> SGMBatch:
        """Copy the batch to a device; keyword arguments are those of `dgl.DGLGraph.to`."""
        return replace(
            self, graph=self.graph.to(device, **kwargs), text=self.text.to(device, **kwargs)
        )

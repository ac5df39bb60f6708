"""The base class of encoders that are written with DGL."""

from __future__ import annotations

from abc import abstractmethod

import dgl
import torch
from torch import Tensor

from datamodules.batch import EDGE_TYPES, NODE_TYPES, Batch
from nep.encoders.encoder import Encoder

EdgeType = tuple[str, str, str]


class DGLEncoder(Encoder):
    """An encoder that gets the batch as a DGL heterograph, for `dgl.nn` and `update_all`.

    A subclass defines `forward_graph`, `num_hops` and `uses_edges`, and keeps each argument of its
    constructor as an attribute of the same name, as every encoder does (docs/research.md has an
    example). Where speed matters, write against the arrays of `Batch` instead:
    benchmarks/dgl_encoder.py compares the two.

    Args:
        units: D, width of the node and edge embeddings, in and out.
    """

    @abstractmethod
    def forward_graph(
        self, graph: dgl.DGLGraph, node: dict[str, Tensor], edge: dict[EdgeType, Tensor]
    ) -> dict[str, Tensor]:
        """Encode the nodes.

        Args:
            graph: `Batch.graph`, with its node and edge data; what is written to it is gone
                afterwards.
            node: embedded nodes of every node type, (N, D) each: float32 while training, float64
                when it is asked (`nep.players.policy`), as are the columns of the graph.
            edge: embedded edges of every edge type, (E, D) each; empty unless `uses_edges`.

        Returns:
            (N, D) for each node type; the nodes of a type that is left out stay as they are.
        """

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Hand the batch to `forward_graph`: (N, D), (E, D) -> (N, D)."""
        # DGL has no kernels for bfloat16 on a CPU.
        dtype = torch.float32 if node.dtype.itemsize < 4 else node.dtype
        heterograph = _take_graph(batch.to(batch.label.device, dtype), node.device)
        with heterograph.local_scope(), torch.autocast(node.device.type, enabled=False):
            nodes = dict(zip(NODE_TYPES, node.to(dtype).split(batch.node_counts), strict=True))
            edges = {}
            if edge is not None:
                edges = dict(zip(EDGE_TYPES, edge.to(dtype).split(batch.edge_counts), strict=True))
            encoded = self.forward_graph(heterograph, nodes, edges)
        return torch.cat([encoded.get(ntype, nodes[ntype]) for ntype in NODE_TYPES])


def _take_graph(batch: Batch, device: torch.device) -> dgl.DGLGraph:
    """Return the graph of a batch on the device of the network."""
    try:
        graph = batch.graph
        return graph if graph.device == device else graph.to(device)
    except (dgl.DGLError, LookupError, RuntimeError) as error:
        raise ValueError(
            f"device of an encoder written with DGL must be one that DGL was built for, got "
            f"{device}. Install such a build of DGL, or train with --trainer.accelerator cpu."
        ) from error

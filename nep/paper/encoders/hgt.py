"""NEP-HGT: a heterogeneous graph transformer, by DGL's layer."""

from __future__ import annotations

from functools import partial
from typing import Any

import torch
from torch import Tensor, nn

from datamodules.dgl_stand_in import GraphStandIn
from datamodules.dgl_stand_in_layers import HGTConv as StandInHGTConv
from datamodules.message_passing import ETYPE, NTYPE, HGTConv
from nep.paper.encoders.encoder import ConvolvingEncoder, check_heads, lie_by_type
from sgm.schema import EDGE_TYPES, NODE_TYPES


class ReluHGTConv(nn.Module):
    """`dgl.nn.HGTConv`, with a ReLU before the last projection, which has its own gated residual.

    Args:
        units: width of the nodes, in and out.
        heads: number of attention heads, each giving `units / heads` units.

    Source: Hu et al. 2020 (arXiv:2003.01332), equations 1 to 5. Differs from DGL's layer: it has
    no dropout, and the ReLU of equation 5.
    """

    def __init__(self, units: int, heads: int) -> None:
        super().__init__()
        check_heads("HGT", heads, units)
        counts = len(NODE_TYPES), len(EDGE_TYPES)
        self.layer = HGTConv(units, units // heads, heads, *counts, dropout=0.0)
        self.layer.linear_a.register_forward_pre_hook(_apply_relu)

    def forward(self, graph: Any, node: Tensor) -> Tensor:
        """Convolve once, on a homogeneous graph of DGL: (N, units) -> (N, units).

        Raises:
            ValueError: if DGL is there, and was not built for the device.
        """
        ntype, etype = graph.ndata[NTYPE], graph.edata[ETYPE]
        if isinstance(graph, GraphStandIn) and not isinstance(self.layer, StandInHGTConv):
            raise ValueError(
                f"device of a layer of dgl.nn must be one that DGL was built for, got {node.device}"
                ". Install such a build of DGL, or train with --trainer.accelerator cpu."
            )
        if not len(etype):  # of which DGL warns
            return node * (1 - torch.sigmoid(self.layer.skip)[ntype].unsqueeze(1))
        presorted = lie_by_type(ntype) and lie_by_type(etype)
        found: Tensor = self.layer(graph, node, ntype, etype, presorted=presorted)
        return found


class HGT(ConvolvingEncoder):
    """Convolutions of a heterogeneous graph transformer.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Source: Hu et al. 2020; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        make = partial(ReluHGTConv, units, heads)
        super().__init__(units, num_convolutions, make, residual=False)
        self.heads = heads


def _apply_relu(_: nn.Module, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    values, *types = arguments
    return torch.relu(values), *types

"""NEP-HGT written with DGL's own module: an example of an encoder against the heterograph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import torch
from torch import Tensor, nn

from datamodules.heterograph import EdgeType
from nep.encoders.encoder import DGLEncoder, check_heads, check_num_convolutions
from sgm.schema import EDGE_TYPES, NODE_TYPES

if TYPE_CHECKING:
    import dgl


class DGLHGT(DGLEncoder):
    """Convolutions of `dgl.nn.HGTConv`; equal to `nep.encoders.HGT` for equal weights.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Raises:
        ValueError: if `units` is not a multiple of `heads`.
        ModuleNotFoundError: if DGL is not installed.

    Source: Hu et al. 2020. Differs from DGL's layer: it has no dropout, and a ReLU before the last
    projection, as the publication has (equation 5).
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        super().__init__(units)
        check_num_convolutions(num_convolutions)
        check_heads("DGLHGT", heads, units)
        from dgl.nn import HGTConv

        self.heads = heads
        self.num_convolutions = num_convolutions
        self.num_hops = num_convolutions
        self.convolutions = nn.ModuleList(
            HGTConv(units, units // heads, heads, len(NODE_TYPES), len(EDGE_TYPES), dropout=0.0)
            for _ in range(num_convolutions)
        )
        for convolution in self.convolutions:
            cast(nn.Module, convolution.linear_a).register_forward_pre_hook(_apply_relu)

    def forward_graph(
        self, graph: dgl.DGLGraph, node: dict[str, Tensor], edge: dict[EdgeType, Tensor]
    ) -> dict[str, Tensor]:
        """Convolve `num_convolutions` times: (N, D) -> (N, D) for each node type."""
        import dgl

        homogeneous = dgl.to_homogeneous(graph)  # sorted by node type and by edge type
        ntype, etype = homogeneous.ndata[dgl.NTYPE], homogeneous.edata[dgl.ETYPE]
        hidden = torch.cat([node[name] for name in graph.ntypes])
        for convolution in self.convolutions:
            hidden = convolution(homogeneous, hidden, ntype, etype, presorted=True)
        parts = hidden.split([graph.num_nodes(name) for name in graph.ntypes])
        return dict(zip(graph.ntypes, parts, strict=True))


def _apply_relu(_: nn.Module, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Take the ReLU of what a layer gets."""
    values, *types = arguments
    return torch.relu(values), *types

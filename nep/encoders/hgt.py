"""NEP-HGT: a heterogeneous graph transformer."""

from __future__ import annotations

from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import Encoder, check_num_convolutions
from nep.layers.hgt import HGTConv


class HGT(Encoder):
    """Convolutions of a heterogeneous graph transformer; each has its own gated residual.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Source: Hu et al. 2020; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        super().__init__(units)
        check_num_convolutions(num_convolutions)
        self.heads = heads
        self.num_convolutions = num_convolutions
        self.num_hops = num_convolutions
        self.convolutions = nn.ModuleList(HGTConv(units, heads) for _ in range(num_convolutions))

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Convolve `num_convolutions` times: (N, D) -> (N, D)."""
        for convolution in self.convolutions:
            node = convolution(batch, node)
        return node

"""NEP-HAN: attention within each edge type, then among edge types."""

from __future__ import annotations

from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import Encoder, check_num_convolutions
from nep.layers.han import HANConv


class HAN(Encoder):
    """Heterogeneous graph attention, an edge type for a meta-path.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.
        residual: whether a convolution's input is added to its output. On: attention runs over a
            node's neighbours and never over itself.

    Source: Wang et al. 2019; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(
        self, units: int = 64, heads: int = 2, num_convolutions: int = 1, residual: bool = True
    ) -> None:
        super().__init__(units)
        check_num_convolutions(num_convolutions)
        self.heads = heads
        self.num_convolutions = num_convolutions
        self.residual = residual
        self.num_hops = num_convolutions
        self.convolutions = nn.ModuleList(HANConv(units, heads) for _ in range(num_convolutions))

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Convolve `num_convolutions` times: (N, D) -> (N, D)."""
        for convolution in self.convolutions:
            convolved = convolution(batch, node)
            node = node + convolved if self.residual else convolved
        return node

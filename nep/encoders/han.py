"""NEP-HAN: attention within each edge type, then among edge types."""

from __future__ import annotations

from functools import partial

from nep.encoders.encoder import ConvolvingEncoder
from nep.layers.han import HANConv


class HAN(ConvolvingEncoder):
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
        super().__init__(units, num_convolutions, partial(HANConv, units, heads), residual)
        self.heads = heads

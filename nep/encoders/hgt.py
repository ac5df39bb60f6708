"""NEP-HGT: a heterogeneous graph transformer."""

from __future__ import annotations

from functools import partial

from nep.encoders.encoder import ConvolvingEncoder
from nep.layers.hgt import HGTConv


class HGT(ConvolvingEncoder):
    """Convolutions of a heterogeneous graph transformer; each has its own gated residual.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Source: Hu et al. 2020; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        super().__init__(units, num_convolutions, partial(HGTConv, units, heads))
        self.heads = heads

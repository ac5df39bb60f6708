"""NEP-GCN: graph convolutions that treat all edges alike."""

from __future__ import annotations

from functools import partial

from nep.encoders.encoder import ConvolvingEncoder
from nep.layers.gcn import GCNConv


class GCN(ConvolvingEncoder):
    """Graph convolutions, each followed by ReLU.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        num_convolutions: 1 in the paper's appendix, 2 in its main text; the appendix is followed,
            which lists what was run.
        residual: whether a convolution's input is added to its output. Off: the self loop of a
            graph convolution already carries the node's own features.
        normalize: whether a sum over neighbours is divided by degrees. Without it the encoding
            grows with the number of neighbours: messages that can count.
        alike: whether furniture of one label in one room then exchanges what it has, see
            `AlikeConv`.

    Source: paper section 4.3, NEP-GCN, and appendix C.
    """

    uses_edges = False
    has_relu = True
    has_equal_rows = True

    def __init__(
        self,
        units: int = 64,
        num_convolutions: int = 1,
        residual: bool = False,
        normalize: bool = True,
        alike: bool = False,
    ) -> None:
        make = partial(GCNConv, units, units, normalize)
        super().__init__(units, num_convolutions, make, residual, alike)
        self.normalize = normalize

"""NEP-HEAT: attention by node type, edge type and edge features."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from nep.encoders.encoder import ConvolvingEncoder
from nep.layers.heat import HEATConv, Sharing


class HEAT(ConvolvingEncoder):
    """Heterogeneous edge-enhanced graph attention, each convolution followed by ReLU.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: the paper's appendix has 1.
        residual: whether a convolution's input is added to its output, after the ReLU.
        edge_units: widths of the embeddings of edge types and of edge attributes.
        root_weight: whether a convolution adds the node's own transformed features. Attention runs
            over a node's neighbours and never over itself: with neither this nor `residual`, the
            two ends of a query edge lose their own label and history.
        sharing: "softmax", or "sigmoid" for attention that can count, see `HEATConv`.
        alike: whether furniture of one label in one room then exchanges what it has, see
            `AlikeConv`.

    Source: paper section 4.3, NEP-HEAT, and appendix C. Where the paper states nothing, heads,
    root weight and residual are PyTorch Geometric's defaults; the edge widths are ours.
    `heat_two_heads.yaml` has two heads and the residual instead.
    """

    uses_edges = True
    has_relu = True
    has_equal_rows = True
    implied: ClassVar = {"root_weight": False}
    joined: ClassVar = {"edge_units": ("edge_type_units", "edge_attribute_units")}

    def __init__(
        self,
        units: int = 64,
        heads: int = 1,
        num_convolutions: int = 1,
        residual: bool = False,
        edge_units: tuple[int, int] = (16, 16),
        root_weight: bool = True,
        sharing: Sharing = "softmax",
        alike: bool = False,
    ) -> None:
        make = partial(HEATConv, units, units, units, heads, *edge_units, root_weight, sharing)
        super().__init__(units, num_convolutions, make, residual, alike)
        self.heads = heads
        self.edge_units = tuple(edge_units)
        self.root_weight = root_weight
        self.sharing = sharing

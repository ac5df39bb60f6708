"""NEP-GCN: graph convolutions that treat all edges alike."""

from __future__ import annotations

from functools import partial

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import ConvolvingEncoder
from nep.layers.equal_rows import Linear
from nep.layers.segment import segment_sum


class GCNConv(nn.Module):
    r"""Graph convolution with self loops and symmetric normalisation.

    .. math:: x'_i = b + \sum_{j \in N(i) \cup \{i\}} \frac{W x_j}{\sqrt{(d_i + 1)(d_j + 1)}}

    with :math:`d` the in-degree. It reads the degree that the nodes had before the graph was
    pruned, so a node whose in-edges were all kept gets the same output from the pruned graph as
    from the full one.

    Args:
        in_units: width of the input nodes.
        out_units: width of the output nodes.
        normalize: whether to divide by the degrees; without it, plain sums.

    Source: Kipf & Welling 2017, equation 2; paper section 4.3.
    """

    def __init__(self, in_units: int, out_units: int, normalize: bool = True) -> None:
        super().__init__()
        self.normalize = normalize
        self.weight = Linear(in_units, out_units, bias=False)
        self.bias = nn.Parameter(torch.zeros(out_units))
        nn.init.xavier_uniform_(self.weight.weight)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Convolve once: (N, in_units) -> (N, out_units)."""
        # The edge weight is a product of a part of the source and a part of the destination:
        # scaling the nodes before and after the sum needs no weight per edge.
        degree = batch.degree if self.normalize else torch.zeros_like(batch.degree)
        scale = (degree + 1.0).rsqrt().unsqueeze(1)  # (N, 1)
        scaled = self.weight(node) * scale
        incoming = segment_sum(
            scaled.index_select(0, batch.edge_src), batch.edge_dst, batch.num_nodes
        )
        return (incoming + scaled) * scale + self.bias


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

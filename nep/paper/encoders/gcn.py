"""NEP-GCN: graph convolutions that treat all edges alike."""

from __future__ import annotations

from functools import partial
from typing import Any

import torch
from torch import Tensor, nn

from datamodules.message_passing import GraphConv
from nep.paper.encoders.encoder import ConvolvingEncoder


class GCNConv(nn.Module):
    r"""Graph convolution with self loops and symmetric normalisation, by `dgl.nn.GraphConv`.

    .. math:: x'_i = b + \sum_{j \in N(i) \cup \{i\}} \frac{W x_j}{\sqrt{(d_i + 1)(d_j + 1)}}

    with :math:`d` the in-degree: `graph.ndata["degree"]`, where it is there. A pruned graph has
    those from before, so that a node whose in-edges were all kept gets the same output.

    Args:
        in_units: width of the input nodes.
        out_units: width of the output nodes.

    Source: Kipf & Welling 2017, equation 2; paper section 4.3.
    """

    def __init__(self, in_units: int, out_units: int) -> None:
        super().__init__()
        self.weight = nn.Linear(in_units, out_units, bias=False)
        self.bias = nn.Parameter(torch.zeros(out_units))
        self.sum = GraphConv(
            out_units, out_units, norm="none", weight=False, bias=False, allow_zero_in_degree=True
        )
        nn.init.xavier_uniform_(self.weight.weight)

    def forward(self, graph: Any, node: Tensor) -> Tensor:
        """Convolve once, on a graph of DGL: (N, in_units) -> (N, out_units)."""
        degree = graph.ndata["degree"] if "degree" in graph.ndata else graph.in_degrees()
        scale = (degree + 1.0).to(node.dtype).rsqrt().unsqueeze(1)  # (N, 1)
        scaled = self.weight(node) * scale
        return (self.sum(graph, scaled) + scaled) * scale + self.bias


class GCN(ConvolvingEncoder):
    """Graph convolutions, each followed by ReLU.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        num_convolutions: 1 in the paper's appendix, 2 in its main text; the appendix is followed,
            which lists what was run.

    Source: paper section 4.3, NEP-GCN, and appendix C.
    """

    uses_edges = False
    has_relu = True

    def __init__(self, units: int = 64, num_convolutions: int = 1) -> None:
        super().__init__(units, num_convolutions, partial(GCNConv, units, units), residual=False)

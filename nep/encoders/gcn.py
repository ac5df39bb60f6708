"""NEP-GCN: graph convolutions that treat all edges alike."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import Encoder, check_num_convolutions
from nep.layers.alike import AlikeConv
from nep.layers.gcn import GCNConv


class GCN(Encoder):
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

    def __init__(
        self,
        units: int = 64,
        num_convolutions: int = 1,
        residual: bool = False,
        normalize: bool = True,
        alike: bool = False,
    ) -> None:
        super().__init__(units)
        check_num_convolutions(num_convolutions)
        self.num_convolutions = num_convolutions
        self.residual = residual
        self.normalize = normalize
        self.alike = alike
        self.num_hops = num_convolutions
        self.convolutions = nn.ModuleList(
            GCNConv(units, units, normalize) for _ in range(num_convolutions)
        )
        self.exchange = AlikeConv(units) if alike else None

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Convolve `num_convolutions` times: (N, D) -> (N, D)."""
        for convolution in self.convolutions:
            convolved = torch.relu(convolution(batch, node))
            node = node + convolved if self.residual else convolved
        return node if self.exchange is None else self.exchange(batch, node)

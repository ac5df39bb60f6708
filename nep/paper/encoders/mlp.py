"""NEP-MLP: no message passing."""

from __future__ import annotations

from typing import Any

from torch import Tensor

from datamodules.batch import Batch
from nep.paper.encoders.encoder import Encoder


class MLP(Encoder):
    """Leaves the embedded nodes as they are.

    Args:
        units: width of the node and edge embeddings.

    Source: paper section 4.3, NEP-MLP.
    """

    num_hops = 0
    uses_edges = False

    def __init__(self, units: int = 64) -> None:
        super().__init__(units)

    def forward(self, graph: Any, node: Tensor, edge: Tensor | None) -> Tensor:
        """Return `node`, (N, units)."""
        return node

    def encode(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Return `node`, without a graph."""
        return node

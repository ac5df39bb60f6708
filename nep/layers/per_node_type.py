"""Products of nodes with the matrix of their type."""

from __future__ import annotations

import torch
from torch import Tensor

from datamodules.batch import Batch
from nep.layers.equal_rows import multiply


def project_per_node_type(
    batch: Batch, node: Tensor, weight: Tensor, bias: Tensor | None = None
) -> Tensor:
    """Multiply each node by the matrix of its type: (N, C), (5, C, D), (5, D) -> (N, D)."""
    rows = enumerate(node.split(batch.node_counts))
    # of a single home two blocks are empty; one stays, since all may be
    blocks = [(number, block) for number, block in rows if len(block) or not number]
    return torch.cat(
        [multiply(block, weight[n], None if bias is None else bias[n]) for n, block in blocks]
    )

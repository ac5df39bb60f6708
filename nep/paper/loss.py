"""The paper's loss of query edges."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F


def balanced_bce(logits: Tensor, target: Tensor) -> Tensor:
    """Binary cross-entropy where the false edges together weigh as much as the true ones.

    The loss of each false edge is multiplied by #true / #false of the batch; then the mean is
    taken. A batch without true edges has loss zero.

    Args:
        logits: (Q,).
        target: (Q,) 1 or 0, nan where the truth is unknown: those edges do not enter.

    Returns:
        Scalar; zero, with gradient zero, if no truth is known.

    Source: paper section 4.3, model training.
    """
    known = ~target.isnan()
    logits, target = logits[known], target[known]
    if len(target) == 0:
        return logits.sum()
    num_true = target.sum()
    num_false = len(target) - num_true
    false_weight = num_true / num_false.clamp(min=1)
    weight = torch.where(target > 0, torch.ones_like(target), false_weight)
    return F.binary_cross_entropy_with_logits(logits, target, weight=weight)

"""Losses of query edges: the paper's, and that of the relevance of places."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F

from nep.training.segment import segment_softmax, segment_sum


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


def relevance_loss(
    logits: Tensor, relevance: Tensor, snapshot: Tensor, num_snapshots: int
) -> Tensor:
    """Cross-entropy between the relevance of a snapshot's query edges and their softmax shares.

    Least where the shares are proportional to the relevance, and with them the ranking right.

    Args:
        logits: (Q,).
        relevance: (Q,) non-negative, of the place of each edge.
        snapshot: (Q,) int64 in 0..B-1, the snapshot of each edge.
        num_snapshots: B.

    Returns:
        Scalar, the mean over snapshots with any relevance; zero, with gradient zero, without one.

    Source: Cao et al. 2007 (ListNet, top one). Not in the paper.
    """
    total = segment_sum(relevance.unsqueeze(1), snapshot, num_snapshots).squeeze(1)
    is_known = total > 0
    if not is_known.any():
        return logits.sum() * 0
    weight = relevance / total.clamp(min=1e-12).index_select(0, snapshot)
    share = segment_softmax(logits.unsqueeze(1), snapshot, num_snapshots).squeeze(1)
    return -(weight * share.clamp(min=1e-12).log()).sum() / is_known.sum()

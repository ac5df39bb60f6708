"""Losses that compare the answers about a snapshot. Not in the paper."""

from __future__ import annotations

import torch
from torch import Tensor

from nep.training.segment import segment_max, segment_softmax, segment_sum


def listwise_loss(
    logits: Tensor, target: Tensor, snapshot: Tensor, num_snapshots: int, best: bool = False
) -> Tensor:
    """Negative log of the softmax share that a snapshot's true query edges get, averaged.

    Where `balanced_bce` asks of each edge whether it is true, this asks which edge of a snapshot
    is. Snapshots without an edge that is known to be true do not enter.

    Where several edges of a snapshot are true, as there are several mugs, it is indifferent to how
    they share what they get: shares learnt so are less than how likely each of them is true. With
    `best`, the greatest of them counts alone: the answer settles for one mug, and is as sure of it
    as it should be.

    Args:
        logits: (Q,).
        target: (Q,) 1 or 0, nan where the truth is unknown: those edges do not enter.
        snapshot: (Q,) int64 in 0..B-1, the snapshot of each edge.
        num_snapshots: B.
        best: whether the true edge with the greatest share counts, and not all of them.

    Returns:
        Scalar; zero, with gradient zero, if no edge is known to be true.

    Source: Cao et al. 2007 (ListNet, top one), with a set of true edges. Not in the paper.
    """
    is_known = ~target.isnan()
    logits, snapshot, is_true = logits[is_known], snapshot[is_known], target[is_known] > 0
    share = segment_softmax(logits.unsqueeze(1), snapshot, num_snapshots)
    pool = segment_max if best else segment_sum
    share_true = pool(share[is_true], snapshot[is_true], num_snapshots).squeeze(1)
    has_true = torch.bincount(snapshot[is_true], minlength=num_snapshots) > 0
    if not has_true.any():
        return logits.sum() * 0
    # Differentiable down to a share of 1e-12, where the logits differ by 28.
    return -share_true[has_true].clamp(min=1e-12).log().mean()


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

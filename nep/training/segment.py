"""Sums, maxima and softmax over groups of rows, such as the answers about one snapshot."""

from __future__ import annotations

import torch
from torch import Tensor


def segment_sum(values: Tensor, segment: Tensor, num_segments: int) -> Tensor:
    """Sum the rows of each segment, in any order: (E, D), (E,) -> (S, D).

    Zero for a segment without rows. Numbers of 16 bits are summed as float32.
    """
    values = _widen(values)
    return values.new_zeros(num_segments, values.shape[1]).index_add(0, segment, values)


def segment_softmax(logits: Tensor, segment: Tensor, num_segments: int) -> Tensor:
    """Softmax over the rows of each segment, each column on its own: (E, H), (E,) -> (E, H).

    Each segment that has rows sums to one. Numbers of 16 bits give float32.
    """
    logits = _widen(logits)
    index = segment.unsqueeze(1).expand_as(logits)
    # The maximum only keeps exp from overflowing; it cancels, so no gradient flows through it.
    peak = logits.new_full((num_segments, logits.shape[1]), -torch.inf)
    peak = peak.scatter_reduce(0, index, logits.detach(), "amax")
    weight = (logits - peak.index_select(0, segment)).exp()
    total = segment_sum(weight, segment, num_segments)
    return weight / total.index_select(0, segment)


def segment_max(values: Tensor, segment: Tensor, num_segments: int) -> Tensor:
    """Return the largest value of each segment, each column on its own: (E, D), (E,) -> (S, D).

    Zero for a segment without rows.
    """
    index, still = segment.unsqueeze(1).expand_as(values), values.detach()
    peak = still.new_zeros(num_segments, values.shape[1])
    peak = peak.scatter_reduce(0, index, still, "amax", include_self=False)
    if not values.requires_grad:
        return peak
    # The gradient of `scatter_reduce` takes five times as long. Rows that tie share it here, too.
    is_peak = (still == peak.index_select(0, segment)).to(values.dtype)
    number = segment_sum(is_peak, segment, num_segments).index_select(0, segment)
    share = segment_sum(values * (is_peak / number), segment, num_segments)
    return peak + (share - share.detach())


def _widen(values: Tensor) -> Tensor:
    """Return numbers of 16 bits, of which sums soon stop growing, as float32."""
    return values.float() if values.dtype.itemsize < 4 else values

"""Share of questions whose best answer is right."""

from __future__ import annotations

import torch
from torch import Tensor
from torchmetrics import Metric

from nep.training.segment import segment_max, segment_sum


class HitsAtOne(Metric):
    """How often the query edge with a snapshot's highest logit is true.

    A snapshot without a true query edge counts as a miss: the place was not among the candidates.
    One without query edges of known truth does not count. Edges that tie for the highest logit
    share the hit, so that the order of edges does not matter.
    """

    is_differentiable = False
    higher_is_better = True
    full_state_update = False
    hits: Tensor
    total: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.add_state("hits", torch.tensor(0.0, dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("total", torch.tensor(0.0, dtype=torch.float64), dist_reduce_fx="sum")

    def update(self, logits: Tensor, target: Tensor, snapshot: Tensor) -> None:
        """Count one batch.

        Args:
            logits: (Q,).
            target: (Q,) 1 or 0, no nan.
            snapshot: (Q,) int64, the snapshot of each query edge within the batch.
        """
        names, segment = snapshot.unique(return_inverse=True)
        logits, target = logits.unsqueeze(1), target.unsqueeze(1)
        best = segment_max(logits, segment, len(names))
        is_best = (logits == best[segment]).double()
        count = segment_sum(torch.cat([is_best, is_best * target], dim=1), segment, len(names))
        self.hits += (count[:, 1] / count[:, 0]).sum()
        self.total += len(names)

    def compute(self) -> Tensor:
        """Hit rate over all batches, nan if there was no snapshot."""
        return self.hits / self.total

"""What the scores of a policy mean as probabilities."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import sum_rows
from sgm.policies.policy import ScoreKind


def compute_probabilities(
    scores: np.ndarray, kind: ScoreKind, is_furniture: np.ndarray | None = None
) -> np.ndarray:
    """Turn scores into probabilities of the places, (Q, F), each row summing to one.

    The one place that says what the scores of a policy (`Policy.score_kind`) mean as probabilities:

    - "weights" (heuristics, filters, oracles): in proportion to the scores, negative ones and
      -inf as 0;
    - "logits" (networks): softmax over the places, -inf as 0. The loss weighs true and false
      edges alike, which multiplies every edge's odds by the same factor; the softmax divides it
      out again.

    A row without any mass is spread evenly over all furniture, as its choice is: the columns where
    `is_furniture`, bool (Q, F), says so, all of them if it is None.
    """
    if kind == "logits":
        best = scores.max(axis=1, keepdims=True)
        weights = np.exp(scores - np.where(np.isfinite(best), best, 0.0))
    else:
        weights = np.maximum(scores, 0.0)
    if is_furniture is None:
        is_furniture = np.ones(scores.shape, dtype=bool)
    count = is_furniture.sum(axis=1)
    total = sum_rows(weights, count)[:, None]
    even = is_furniture / count[:, None]
    return np.divide(weights, total, out=even, where=total > 0)

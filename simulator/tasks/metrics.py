"""Metrics of answers: NDCG, calibration, and whether an object has left its last known place."""

from __future__ import annotations

import numpy as np

from simulator.memory.memory_batch import NEVER, MemoryBatch, Queries
from simulator.policies.policy import ScoreKind

# What an answer costs at most in `compute_nll`: 13.8 nats, instead of infinity.
MIN_PROBABILITY = 1e-6


def compute_ndcg(scores: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Return the normalised discounted cumulative gain of rankings of all furniture, (Q,).

    The n-th place of a ranking counts 1 / log2(n + 1) of its gain, and the sum is divided by that
    of the best ranking. Places of equal score share their ranks: each counts their mean discount.
    Places without a score (-inf) come last and tie. Without any gain the value is 0.

    Args:
        scores: the higher the likelier, -inf for no opinion, (Q, F).
        gains: non-negative: how much each place is worth, (Q, F).

    Raises:
        ValueError: if a score is nan, or the shapes differ.

    Source: Jarvelin & Kekalainen 2002; paper section 5.2; docs/design.md, ruling 17. Equals
    scikit-learn's
    `ndcg_score` with its default of averaging ties.
    """
    if scores.shape != gains.shape:
        raise ValueError(
            f"gains must have the shape of the scores {scores.shape}, got {gains.shape}. "
            "Give one gain per score."
        )
    if np.isnan(scores).any():
        raise ValueError("scores must be numbers or -inf, got nan. Check the policy.")
    discounts = 1 / np.log2(np.arange(scores.shape[1]) + 2)  # (F,)
    total = np.concatenate([[0.0], np.cumsum(discounts)])
    better, equal = _count_better_and_equal(scores)  # (Q, F)
    found = (gains * (total[better + equal] - total[better]) / equal).sum(axis=1)
    best = (-np.sort(-gains, axis=1) * discounts).sum(axis=1)
    return np.divide(found, best, out=np.zeros(len(found)), where=best > 0)


def _count_better_and_equal(scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count the places of a higher and of the same score, itself included, (Q, F) each."""
    order = np.argsort(-scores, axis=1)
    ranked = np.take_along_axis(scores, order, axis=1)
    index = np.arange(scores.shape[1])
    is_first = np.ones(scores.shape, dtype=bool)
    np.not_equal(ranked[:, 1:], ranked[:, :-1], out=is_first[:, 1:])
    first = np.maximum.accumulate(np.where(is_first, index, 0), axis=1)
    is_last = np.ones(scores.shape, dtype=bool)
    is_last[:, :-1] = is_first[:, 1:]
    last = np.where(is_last, index, scores.shape[1])
    last = np.minimum.accumulate(last[:, ::-1], axis=1)[:, ::-1]
    better, equal = np.empty_like(order), np.empty_like(order)
    np.put_along_axis(better, order, first, axis=1)
    np.put_along_axis(equal, order, last - first + 1, axis=1)
    return better, equal


def compute_probabilities(scores: np.ndarray, kind: ScoreKind) -> np.ndarray:
    """Turn scores into probabilities of the places, (Q, F), each row summing to one.

    The one place that says what the scores of a policy mean as probabilities:

    - "weights" (heuristics, filters, oracles): in proportion to the scores, negative ones and
      -inf as 0;
    - "logits" (networks): softmax over the places, -inf as 0. The loss weighs true and false
      edges alike, which multiplies every edge's odds by the same factor; the softmax divides it
      out again.

    A row without any mass is spread evenly over all furniture, as its choice is.

    Args:
        scores: (Q, F).
        kind: `Policy.score_kind`.
    """
    if kind == "logits":
        best = scores.max(axis=1, keepdims=True)
        weights = np.exp(scores - np.where(np.isfinite(best), best, 0.0))
    else:
        weights = np.maximum(scores, 0.0)
    total = weights.sum(axis=1, keepdims=True)
    even = np.full(scores.shape, 1 / scores.shape[1])
    return np.divide(weights, total, out=even, where=total > 0)


def compute_calibration_error(
    confidence: np.ndarray, is_correct: np.ndarray, num_bins: int = 10
) -> float:
    """Return the expected calibration error of answers, in [0, 1]; nan without answers.

    Answers are grouped into bins of equal width by confidence; the error is the mean over answers
    of the distance between the accuracy and the mean confidence of their bin.

    Args:
        confidence: probability that the policy gave to the place it chose, (n,).
        is_correct: whether that place was right, (n,).
        num_bins: bins of [0, 1].

    Source: Guo et al. 2017, equation 3.
    """
    if len(confidence) == 0:
        return float("nan")
    bins = np.minimum((confidence * num_bins).astype(np.int64), num_bins - 1)
    gap = np.bincount(bins, weights=is_correct - confidence, minlength=num_bins)
    return float(np.abs(gap).sum() / len(confidence))


def compute_nll(likelihood: np.ndarray) -> float:
    """Return the mean negative log likelihood of the true places, in nats; nan without answers.

    Args:
        likelihood: probability that the policy gave to the true places together, (n,); it is taken
            as at least `MIN_PROBABILITY`.
    """
    if len(likelihood) == 0:
        return float("nan")
    return float(-np.log(np.maximum(likelihood, MIN_PROBABILITY)).mean())


def compute_away(memory: MemoryBatch, queries: Queries, answers: np.ndarray) -> np.ndarray:
    """Mark the queries whose object was seen before and is not where it was last seen, bool (Q,).

    What an agent has seen depends on its policy, and so does which objects are away for it.

    Args:
        memory: before the look that follows the query.
        queries: the queries.
        answers: furniture that truly holds such an object, bool (Q, F).
    """
    last = memory.objects["last_furniture"][queries.object]
    return (last != NEVER) & ~answers[np.arange(len(last)), last]

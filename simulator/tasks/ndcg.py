"""Normalised discounted cumulative gain of rankings of all furniture."""

from __future__ import annotations

import numpy as np


def compute_ndcg(
    scores: np.ndarray, relevance: np.ndarray, is_place: np.ndarray | None = None
) -> np.ndarray:
    """Return the normalised discounted cumulative gain of rankings of all furniture, (Q,).

    The n-th place of a ranking counts 1 / log2(n + 1) of its relevance, and the sum is divided
    by that of the best ranking. Places of equal score share their ranks: each counts their mean
    discount. Places without a score (-inf) come last and tie. Without any relevance the value is 0.

    Args:
        scores: the higher the likelier, -inf for no opinion, (Q, F).
        relevance: of each place, non-negative, (Q, F).
        is_place: what is ranked, bool (Q, F); None for all.

    Raises:
        ValueError: if a score is nan, or the shapes differ.

    Source: Jarvelin & Kekalainen 2002; paper section 5.2; docs/design.md, ruling 17. Equals
    scikit-learn's `ndcg_score` with its default of averaging ties.
    """
    if scores.shape != relevance.shape:
        raise ValueError(
            f"relevance must have the shape of the scores {scores.shape}, got {relevance.shape}. "
            "Give one relevance per score."
        )
    if np.isnan(scores).any():
        raise ValueError("scores must be numbers or -inf, got nan. Check the policy.")
    if is_place is not None:
        scores, relevance = np.where(is_place, scores, -np.inf), np.where(is_place, relevance, 0.0)
    discounts = 1 / np.log2(np.arange(scores.shape[1]) + 2)  # (F,)
    total = np.concatenate([[0.0], np.cumsum(discounts)])
    better, equal = _count_better_and_equal(scores)  # (Q, F)
    if is_place is not None:  # what is no place ties with places without a score: behind them
        num_others = (~is_place).sum(axis=1, keepdims=True)
        equal = np.maximum(np.where(scores > -np.inf, equal, equal - num_others), 1)
    found = (relevance * (total[better + equal] - total[better]) / equal).sum(axis=1)
    best = (-np.sort(-relevance, axis=1) * discounts).sum(axis=1)
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

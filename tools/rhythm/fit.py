"""Weights of what similar moments say beside a policy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from sgm.belief import Belief
from sgm.evidence.similar_moments import compare_moments
from sgm.policies.rhythm import TERMS, RhythmTerms
from tools.rhythm.answers import MOST_PLACES, Arrays, read_past

_PENALTY = 2e-4  # of the squares of the weights, halved, beside the mean loss
_LEAST = 1e-4  # probability
_MOVED = 1.4  # what a thing that had moved counts, so that the loss of these does not grow


class Problem(NamedTuple):
    """Questions, and what is known of each of P answers.

    Attributes:
        terms: what is weighed.
        believed: probability of each answer by the policy, (n, P).
        answer: the right one, (n,).
        has_moved: whether that is not where the thing was seen last, bool (n,).
    """

    terms: RhythmTerms
    believed: np.ndarray
    answer: np.ndarray
    has_moved: np.ndarray

    @classmethod
    def of(cls, answers: Arrays, policy: str) -> Problem:
        """Make the terms of what was asked in a home, and answered by a policy."""
        past, believed = read_past(answers), answers[policy].astype(float)
        answer = answers["answer"].astype(np.int64)
        return cls(
            RhythmTerms.make(believed, compare_moments(past), past),
            believed,
            answer,
            answer != np.where(past.last < 0, MOST_PLACES, past.last),
        )

    @classmethod
    def join(cls, problems: Sequence[Problem]) -> Problem:
        """Return the questions of all."""
        terms, *others = zip(*problems, strict=True)
        names = RhythmTerms.__slots__
        joined = [np.concatenate([getattr(each, name) for each in terms]) for name in names]
        return cls(RhythmTerms(*joined), *map(np.concatenate, others))

    def weigh(self, weights: np.ndarray) -> np.ndarray:
        """Return the probability of each answer by the policy and weights of `TERMS`, (n, P)."""
        with np.errstate(divide="ignore"):
            log_believed = np.log(self.believed)
        return Belief(self.terms.weigh(log_believed, weights)).probabilities


def fit_weights(problem: Problem) -> np.ndarray:
    """Return the weights of `TERMS` with the least log loss of whether a thing has moved."""
    terms, question = problem.terms, np.arange(len(problem.answer))
    is_known = terms.stay.any(axis=1)
    x, has_moved = terms.stay[is_known], problem.has_moved[is_known]
    before = problem.believed[question, terms.last][is_known]
    before = np.log(np.maximum(before, _LEAST) / np.maximum(1 - before, _LEAST))
    counts = np.where(has_moved, _MOVED, 1.0) / len(before)

    def compute_loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        odds = before + x @ weights
        loss = counts @ np.logaddexp(0.0, np.where(has_moved, odds, -odds))
        wrong = counts * (1 / (1 + np.exp(-odds)) - ~has_moved)
        return loss + _PENALTY * (weights**2).sum() / 2, x.T @ wrong + _PENALTY * weights

    start = np.zeros(len(TERMS))
    found: np.ndarray = minimize(compute_loss, start, jac=True, method="L-BFGS-B").x
    return found


class Quality(NamedTuple):
    """How good answers are: share of right first ones, nats, and both of what had moved."""

    right: float
    nats: float
    right_moved: float
    nats_moved: float

    @classmethod
    def of(cls, problem: Problem, probabilities: np.ndarray) -> Quality:
        """Measure the probability of each answer, (n, P)."""
        is_right, moved = probabilities.argmax(axis=1) == problem.answer, problem.has_moved
        right = probabilities[np.arange(len(is_right)), problem.answer]
        losses = -np.log(np.maximum(right, _LEAST))
        values = is_right, losses, is_right[moved], losses[moved]
        return cls(*(float(each.mean()) for each in values))

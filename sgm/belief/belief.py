"""Beliefs about things: log weights over places and "elsewhere"."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)  # no slots: probabilities are kept
class Belief:
    """Where each of K things may be: at one of F places, or elsewhere.

    Attributes:
        log_weights: float64 (K, F + 1), the last column for elsewhere; -inf for what is ruled out.
            Only differences within a row mean something.
    """

    log_weights: np.ndarray

    @classmethod
    def of(cls, places: np.ndarray, elsewhere: np.ndarray | float) -> Belief:
        """Make a belief of places and of elsewhere.

        Args:
            places: weights of the places, 0 or more, (K, F). Where none has any, the thing is
                elsewhere.
            elsewhere: probability of elsewhere, (K,) or one for all; the places share the rest in
                proportion.
        """
        total = places.sum(axis=1)
        is_some = total > 0
        rest = np.where(is_some, 1 - np.asarray(elsewhere), 0.0)
        weights = np.empty((len(places), places.shape[1] + 1))
        weights[:, :-1] = places * (rest / np.where(is_some, total, 1.0))[:, None]
        weights[:, -1] = 1 - rest
        with np.errstate(divide="ignore"):
            return cls(np.log(weights))

    @classmethod
    def of_logits(cls, scores: np.ndarray, elsewhere: np.ndarray | float) -> Belief:
        """Make a belief of logits of the places, (K, F), -inf rules one out; see `of`."""
        best = scores.max(axis=1, keepdims=True)
        return cls.of(np.exp(scores - np.where(np.isfinite(best), best, 0.0)), elsewhere)

    @cached_property
    def probabilities(self) -> np.ndarray:
        """Probability of each place and of elsewhere, (K, F + 1); zeros where all is ruled out.

        Computed once; to be read.
        """
        best = self.log_weights.max(axis=1, keepdims=True)
        weights = np.exp(self.log_weights - np.where(np.isfinite(best), best, 0.0))
        total = weights.sum(axis=1, keepdims=True)
        return np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)

    @property
    def places(self) -> np.ndarray:
        """Probability of each place, (K, F)."""
        return self.probabilities[:, :-1]

    @property
    def elsewhere(self) -> np.ndarray:
        """Probability of elsewhere, (K,)."""
        return self.probabilities[:, -1]

    def look(self, log_likelihood: np.ndarray) -> Belief:
        """Fold looks in by Bayes' rule.

        `log_likelihood` is that of what the looks showed, if the thing is at each place, (K, F); if
        it is elsewhere, the likelihood is one.
        """
        if not log_likelihood.any():  # nothing was looked for
            return self
        changed = self.log_weights.copy()
        changed[:, :-1] += log_likelihood
        return Belief(changed)

    def take(self, rows: list[int]) -> Belief:
        """Return the belief about some of the things, about one perhaps several times."""
        return Belief(self.log_weights[rows])

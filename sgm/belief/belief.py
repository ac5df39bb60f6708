"""Beliefs about things: log weights over places and "elsewhere"."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sgm.belief.corrections import CORRECTIONS


@dataclass(frozen=True)  # no slots: probabilities are kept
class Belief:
    """Where each of K things may be: at one of F places, or elsewhere.

    Attributes:
        log_weights: float64 (K, F + 1), the last column for elsewhere; -inf for what is ruled out.
            Only differences within a row mean something.
    """

    log_weights: np.ndarray

    @classmethod
    def of(cls, places: np.ndarray, elsewhere: np.ndarray | float = 0.0) -> Belief:
        """Make a belief of weights, 0 or more, of places, (K, F), and of elsewhere, (K,) or one."""
        weights = np.empty((len(places), places.shape[1] + 1))
        weights[:, :-1], weights[:, -1] = places, elsewhere
        return cls(_log(weights))

    @classmethod
    def of_logits(cls, scores: np.ndarray, elsewhere: float) -> Belief:
        """Make a belief of a network's logits.

        Args:
            scores: of the places, (K, F); -inf rules one out. Where all are, the thing is
                elsewhere.
            elsewhere: probability of elsewhere.
        """
        logits = np.full((len(scores), scores.shape[1] + 1), -np.inf)
        logits[:, :-1] = scores
        return cls(logits).with_elsewhere(elsewhere)

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

    def with_elsewhere(self, probability: np.ndarray | float) -> Belief:
        """Return the belief with another probability of elsewhere, (K,) or one for all.

        The places keep their proportions. Where none has any weight, the thing is elsewhere.
        """
        places = self.places
        total = places.sum(axis=1, keepdims=True)
        shares = np.divide(places, total, out=np.zeros_like(places), where=total > 0)
        gone = np.where(total[:, 0] > 0, probability, 1.0)
        return Belief.of(shares * (1 - gone[:, None]), gone)

    def mix(self, other: Belief, share: np.ndarray | float) -> Belief:
        """Return a mixture: `share` of the other's probabilities, (K,) or one for all."""
        share = np.reshape(share, (-1, 1))
        mixed = (1 - share) * self.probabilities + share * other.probabilities
        return Belief(_log(mixed))

    def spread(self, share: float) -> Belief:
        """Return the belief with a share of what is at places spread evenly over all of them."""
        mixed = self.probabilities.copy()
        there = 1 - mixed[:, -1:]
        mixed[:, :-1] = (1 - share) * mixed[:, :-1] + share * there / (mixed.shape[1] - 1)
        return Belief(_log(mixed))

    def temper(self, temperature: float) -> Belief:
        """Return a belief that is less sure of itself (above 1), or more (below)."""
        return Belief(self.log_weights / temperature)

    def look(
        self, log_likelihood: np.ndarray, keeps_elsewhere: np.ndarray | bool = False
    ) -> Belief:
        """Fold looks in by Bayes' rule.

        Args:
            log_likelihood: of what the looks showed, if the thing is at each place, (K, F); if it
                is elsewhere, the likelihood is one.
            keeps_elsewhere: whether elsewhere counts these looks already, bool (K,) or one for
                all: then they say which places are likelier, and no more.
        """
        if not log_likelihood.any():  # nothing was looked for
            return self
        changed = self.log_weights.copy()
        changed[:, :-1] += log_likelihood
        if np.any(keeps_elsewhere):
            before, after = (_log_sum(weights[:, :-1]) for weights in (self.log_weights, changed))
            keeps = keeps_elsewhere & np.isfinite(after)
            loss = np.subtract(before, after, out=np.zeros(len(after)), where=keeps)
            changed[:, :-1] += loss[:, None]
        return Belief(changed)

    def join(self, seen: np.ndarray, carried: np.ndarray) -> tuple[np.ndarray, float]:
        """Return where any of the K things is.

        Args:
            seen: confidence with which each was seen at each place in this step, 0 where it was
                not, (K, F): it is there with that, at most `CORRECTIONS.seen_now`; the rest keeps
                its proportions.
            carried: probability that the robot has each in its hand, (K,): then it is nowhere else.

        Returns:
            Probability that at least one of them is at each place, (F,), and that none is at any.
            They sum to one for one thing that is not carried, unless it was seen at several places
            at once.
        """
        places, elsewhere = self.places, self.elsewhere
        if seen.any():
            seen = np.minimum(seen, CORRECTIONS.seen_now)
            missing = np.prod(1 - seen, axis=1)  # no sighting was right
            rest = np.where(seen > 0, 0.0, places)
            left = rest.sum(axis=1) + elsewhere
            share = np.divide(missing, left, out=np.zeros(len(left)), where=left > 0)
            is_seen = np.any(seen, axis=1)
            own = np.where(seen > 0, seen, rest * share[:, None])
            places = np.where(is_seen[:, None], own, places)
            elsewhere = np.where(is_seen, elsewhere * share, elsewhere)
        if carried.any():
            places, elsewhere = places * (1 - carried)[:, None], elsewhere * (1 - carried)
        if len(places) == 1:
            return places[0], float(elsewhere[0])
        return 1 - np.prod(1 - places, axis=0), float(np.prod(elsewhere))


def _log(weights: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(weights)


def _log_sum(log_weights: np.ndarray) -> np.ndarray:
    """Return the logarithm of the sum of each row of weights, (K, F) -> (K,); -inf for none."""
    best = log_weights.max(axis=1, initial=-np.inf)
    best = np.where(np.isfinite(best), best, 0.0)
    return best + _log(np.exp(log_weights - best[:, None]).sum(axis=1))

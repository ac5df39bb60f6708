"""Probabilities from logits, with the possibility that the object is at no known place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from nep.players.searches import Decisions
from simulator.policies.probabilities import compute_probabilities
from simulator.robot.finder import check_share
from simulator.tasks.metrics import compute_calibration_error, compute_nll


@dataclass(frozen=True, slots=True)
class Calibration:
    """What turns logits of places into probabilities that mean what they say.

    Looks in vain are places looked at in this very time step without showing the object:

        elsewhere = sigmoid(elsewhere_logit + elsewhere_slope * s)
        places    = (1 - elsewhere) * softmax(logit / temperature + absent_logit * in_vain)

    with s the share of candidate places that were looked at in vain. So "elsewhere" does not depend
    on how many places a home has.

    Attributes:
        temperature: above 1 where the network is too sure of itself.
        absent_logit: of a place that was looked at in vain, on top of what the network, which has
            seen the same, makes of it.
        elsewhere_logit: of "elsewhere" before any look; -inf for never.
        elsewhere_slope: what looking at all places in vain adds to it.
        elsewhere_share: share of the searches it was fitted to whose object was elsewhere.

    Source: Guo et al. 2017 (temperature).
    """

    temperature: float = 1.0
    absent_logit: float = 0.0
    elsewhere_logit: float = -np.inf
    elsewhere_slope: float = 0.0
    elsewhere_share: float = 0.0

    def compute_probabilities(self, scores: np.ndarray, is_absent: np.ndarray) -> np.ndarray:
        """Return the probability of each place and, last, of "elsewhere", (Q, F + 1).

        Each row sums to one; places without a score have probability 0, and where no place has
        one, the object is elsewhere.

        Args:
            scores: logits, -inf where there is no candidate edge, (Q, F).
            is_absent: from `find_absent`, bool (Q, F).
        """
        is_candidate = np.isfinite(scores)
        is_vain = is_absent & is_candidate
        share = is_vain.sum(axis=1) / np.maximum(is_candidate.sum(axis=1), 1)  # (Q,)
        elsewhere = expit(self.elsewhere_logit + self.elsewhere_slope * share)
        elsewhere[~is_candidate.any(axis=1)] = 1.0
        logits = scores / self.temperature + self.absent_logit * is_vain
        places = compute_probabilities(logits, "logits") * (1 - elsewhere[:, None])
        return np.concatenate([places, elsewhere[:, None]], axis=1)

    def with_share(self, share: float) -> Calibration:
        """Return the calibration for a user who asks for things elsewhere more or less often.

        Args:
            share: of searches whose object is at no known place, above 0 and below 1.

        Raises:
            ValueError: if the share is out of range.
        """
        check_share(share)
        if not 0 < self.elsewhere_share < 1:  # never fitted: before any look, as often as said
            return replace(self, elsewhere_logit=float(logit(share)), elsewhere_share=share)
        shift = logit(share) - logit(self.elsewhere_share)
        return replace(
            self,
            elsewhere_logit=float(self.elsewhere_logit + shift),
            elsewhere_share=share,
        )


def fit_calibration(decisions: Decisions) -> Calibration:
    """Fit all parameters by their mean negative log likelihood.

    Args:
        decisions: in validation homes, some of them for objects that are elsewhere.
    """

    def unpack(values: np.ndarray) -> Calibration:
        return Calibration(
            temperature=float(np.exp(values[0])),
            absent_logit=float(values[1]),
            elsewhere_logit=float(values[2]),
            elsewhere_slope=float(values[3]),
            elsewhere_share=decisions.elsewhere_share,
        )

    def loss(values: np.ndarray) -> float:
        return measure_calibration(decisions, unpack(values))["nll"]

    return unpack(minimize(loss, np.zeros(4), method="BFGS").x)


def measure_calibration(decisions: Decisions, calibration: Calibration) -> dict[str, float]:
    """Measure how far probabilities can be believed.

    Args:
        decisions: in homes that the calibration was not fitted to.
        calibration: what is measured.

    Returns:
        "nll": mean negative log likelihood of the truth, in nats. "ece": expected calibration error
        of the likeliest answer, "elsewhere" among them. "ece_first": the same of first looks.
        "ece_elsewhere": of the probability of "elsewhere". "elsewhere_there", "elsewhere_gone":
        its mean where the object is at a known place, and where it is not; 0 without such ones.
    """
    probability = calibration.compute_probabilities(decisions.scores, decisions.is_absent)
    truth = decisions.answers
    choice = probability.argmax(axis=1)
    rows = np.arange(len(choice))
    confidence, is_right = probability[rows, choice], truth[rows, choice]
    first = decisions.num_looks == 0
    elsewhere, is_gone = probability[:, -1], truth[:, -1]
    return {
        "nll": compute_nll((probability * truth).sum(axis=1)),
        "ece": compute_calibration_error(confidence, is_right),
        "ece_first": compute_calibration_error(confidence[first], is_right[first]),
        "ece_elsewhere": compute_calibration_error(elsewhere, is_gone),
        "elsewhere_there": _mean(elsewhere[~is_gone]),
        "elsewhere_gone": _mean(elsewhere[is_gone]),
    }


def _mean(values: np.ndarray) -> float:
    return float(values.sum() / max(len(values), 1))

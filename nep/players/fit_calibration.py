"""Fits of `sgm.network.calibration.Calibration`, and how far probabilities can be believed."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from nep.players.calibration_searches import Decisions
from sgm.network.calibration import Calibration
from sgm.policies.probabilities import compute_probabilities
from simulator.tasks.metrics import compute_calibration_error, compute_nll

__all__ = ["Calibration", "fit_calibration", "measure_calibration"]

_SPREAD = 0.1  # of ln(temperature): trained by likelihood, heat has -0.01
_SLOPE_SPREAD = 0.5  # of best_slope


def fit_calibration(decisions: Decisions, *, alike: bool = False) -> Calibration:
    """Fit temperature and slope by the mean negative log likelihood; the share is counted.

    Normal priors hold ln(temperature) and the slope near 0, with standard deviations of `_SPREAD`
    and `_SLOPE_SPREAD`: a week in one home must not make a network much surer, or less sure, than
    its training did.

    Args:
        decisions: in validation homes, some of them for objects that are elsewhere.
        alike: whether "elsewhere" has the same share in all questions: no slope.
    """
    share, first = decisions.elsewhere_share, decisions.scores[decisions.num_looks == 0]
    first = first[np.isfinite(first).any(axis=1)]

    spread = np.array([_SPREAD] if alike else [_SPREAD, _SLOPE_SPREAD])

    def make(values: np.ndarray) -> Calibration:
        temperature = float(np.exp(values[0]))
        if alike:
            return Calibration(temperature, share)
        slope = float(values[1])
        best = compute_probabilities(first / temperature, "logits").max(axis=1)
        # the mean of what the odds are multiplied by is one, so that the share stays what it is
        mean = -np.log(np.mean(best**-slope)) / slope if slope else np.log(best).mean()
        return Calibration(temperature, share, slope, float(mean))

    def loss(values: np.ndarray) -> float:
        prior = 0.5 * ((values / spread) ** 2).sum()
        nll = measure_calibration(decisions, make(values))["nll"]
        return float(nll + prior / max(len(decisions.scores), 1))

    if alike:
        found = minimize_scalar(lambda x: loss(np.array([x])), bounds=(-3.0, 3.0), method="bounded")
        return make(np.array([found.x]))
    return make(minimize(loss, np.zeros(2), method="Nelder-Mead").x)


def measure_calibration(decisions: Decisions, calibration: Calibration | None) -> dict[str, float]:
    """Measure how far probabilities can be believed.

    Args:
        decisions: in homes that the calibration was not fitted to.
        calibration: what is measured; None for the softmax of the network's logits, asked again
            after every look.

    Returns:
        "nll": mean negative log likelihood of the truth, in nats. "ece": expected calibration error
        of the likeliest answer, "elsewhere" among them. "ece_first": the same of first looks.
        "ece_elsewhere": of the probability of "elsewhere". "elsewhere_there", "elsewhere_gone":
        its mean where the object is at a known place, and where it is not; 0 without such ones.
    """
    if calibration is None:
        probability = Calibration().compute_probabilities(decisions.asked_again)
    else:
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

"""Probabilities from logits, with the possibility that the object is at no known place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from nep.players.searches import Decisions
from sgm.belief import Detector
from sgm.finder.finder import check_share
from sgm.policies.probabilities import compute_probabilities
from simulator.tasks.metrics import compute_calibration_error, compute_nll

# What older exported networks say of looks in the present time step: the finder applies Bayes'
# rule to these now.
_FORMER = ("absent_logit", "elsewhere_logit", "elsewhere_slope")


_MISS_RATE = Detector().miss_rate  # of the homes that are searched
_SPREAD = 0.1  # of ln(temperature): trained by likelihood, heat has -0.01
_SLOPE_SPREAD = 0.5  # of best_slope


@dataclass(frozen=True, slots=True)
class Calibration:
    """What turns logits of places into probabilities that mean what they say.

    Before any look of a time step, with p = softmax(logit / temperature):

        odds(elsewhere) = odds(elsewhere_share) * (exp(best_mean) / max(p)) ** best_slope
        places          = (1 - elsewhere) * p

    so that what the network has no good place for is more likely to be at none.

    Each look of the step that does not show the object multiplies its place by the miss rate of
    the detector, and all is normalised: Bayes' rule, as in `sgm.belief`.

    Attributes:
        temperature: above 1 where the network is too sure of itself.
        elsewhere_share: share of the searches it was fitted to whose object was at no known place;
            0 where nothing was fitted.
        best_slope: how much "elsewhere" depends on the probability of the best place; 0: not.
        best_mean: a mean of ln max(p) in first looks of the searches it was fitted to: with it,
            the odds are on average those of the share.

    Source: Guo et al. 2017 (temperature).
    """

    temperature: float = 1.0
    elsewhere_share: float = 0.0
    best_slope: float = 0.0
    best_mean: float = 0.0

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Calibration:
        """Read what an exported network says; what only older ones say is left out.

        Raises:
            TypeError: if it says something else.
        """
        return cls(**{name: value for name, value in data.items() if name not in _FORMER})

    def compute_probabilities(
        self, scores: np.ndarray, is_absent: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the probability of each place and, last, of "elsewhere", (Q, F + 1).

        Each row sums to one; places without a score have probability 0, and where no place has
        one, the object is elsewhere.

        Args:
            scores: logits before any look, -inf where there is no candidate edge, (Q, F).
            is_absent: places where a look of this step did not show it, bool (Q, F); None for none.
        """
        places = compute_probabilities(scores / self.temperature, "logits")
        is_known = np.isfinite(scores).any(axis=1)
        best = np.log(np.where(is_known, places.max(axis=1), 1.0))
        weight = self.elsewhere_share * np.exp(self.best_slope * (self.best_mean - best))
        elsewhere = np.where(is_known, weight / (weight + 1 - self.elsewhere_share), 1.0)
        places = places * (1 - elsewhere[:, None])
        if is_absent is not None:
            places = places * np.where(is_absent, _MISS_RATE, 1.0)
        both = np.column_stack([places, elsewhere])
        return both / both.sum(axis=1, keepdims=True)

    def with_share(self, share: float) -> Calibration:
        """Return the calibration for a user who asks for things elsewhere more or less often.

        Args:
            share: of searches whose object is at no known place, above 0 and below 1.

        Raises:
            ValueError: if the share is out of range.
        """
        check_share(share)
        return replace(self, elsewhere_share=share)


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

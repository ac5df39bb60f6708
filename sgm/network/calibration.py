"""Probabilities from logits, with the possibility that the object is at no known place."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sgm.belief import Belief, Detector
from sgm.checks import check_elsewhere_share
from sgm.messages import shorten

# What older exported networks say of looks in the present time step: the finder applies Bayes'
# rule to these now.
_FORMER = ("absent_logit", "elsewhere_logit", "elsewhere_slope")

_DETECTOR = Detector()  # of the homes that are searched: the paper's


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

    def make_belief(self, scores: np.ndarray) -> Belief:
        """Return the belief before any look of the time step.

        Places without a score are ruled out, and where no place has one, the object is elsewhere.

        Args:
            scores: logits, -inf where there is no candidate edge, (Q, F).
        """
        logits = np.full((len(scores), scores.shape[1] + 1), -np.inf)
        logits[:, :-1] = scores
        belief = Belief(logits).temper(self.temperature)
        best = belief.places.max(axis=1)
        with np.errstate(divide="ignore"):  # ruled out everywhere: elsewhere
            weight = self.elsewhere_share * np.exp(
                self.best_slope * (self.best_mean - np.log(np.where(best > 0, best, 1.0)))
            )
        return belief.with_elsewhere(weight / (weight + 1 - self.elsewhere_share))

    def compute_probabilities(
        self, scores: np.ndarray, is_absent: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the probability of each place and, last, of "elsewhere", (Q, F + 1).

        Args:
            scores: as in `make_belief`.
            is_absent: places where a look of this step did not show it, bool (Q, F); None for none.
        """
        belief = self.make_belief(scores)
        if is_absent is not None:
            belief = belief.look(np.log(_DETECTOR.compute_miss(is_absent.astype(float))))
        return belief.probabilities

    def with_share(self, share: float) -> Calibration:
        """Return the calibration for a user who asks for things elsewhere more or less often.

        Args:
            share: of searches whose object is at no known place, above 0 and below 1.

        Raises:
            ValueError: if the share is out of range.
        """
        check_elsewhere_share(share)
        return replace(self, elsewhere_share=share)


def read_calibration(data: Any) -> Calibration | None:
    """Read a calibration; None if there is none.

    Raises:
        TypeError, ValueError: if a value is no number, or out of range.
    """
    if data is None:
        return None
    for name, value in data.items():  # also of what only older networks say
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not value <= sys.float_info.max:
            raise TypeError(f"{name} of the calibration is {shorten(value)}")
    calibration = Calibration.from_json(data)
    if not 0 < calibration.temperature < math.inf or not 0 <= calibration.elsewhere_share <= 1:
        raise TypeError("temperature or elsewhere_share of the calibration is out of range")
    if abs(calibration.best_slope) > 100 or abs(calibration.best_mean) > 100:
        raise TypeError("best_slope or best_mean of the calibration is out of range")
    return calibration

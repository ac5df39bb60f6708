"""What the scores of a detector mean as probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.checks import is_number
from sgm.messages import shorten

_LEAST = 1e-4  # of a score: one of 0 or 1 has no logit
_MOST_SLOPE, _MOST_OFFSET = 100.0, 100.0
_ROUNDS = 100
_RIDGE = 1.0  # sightings that speak for leaving scores as they are
FEWEST_SCORES = 20  # to fit from


@dataclass(frozen=True, slots=True)
class ScoreCalibration:
    """Turns the score of a detection into the probability that it is right.

    A logistic curve over the logit of the score:

        p = 1 / (1 + exp(-(offset + slope logit(score))))

    so that offset 0 and slope 1 leave scores as they are. A score of exactly 0 or 1 is none that a
    detector computes, and stays as it is.

    Attributes:
        slope: above 0.
        offset: above 0 where scores are too low.

    Source: Platt 1999, "Probabilistic Outputs for Support Vector Machines"; over logits as in
    Kull, Silva Filho and Flach 2017, "Beta calibration".
    """

    slope: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for what is no number, or out of range."""
        if not is_number(self.slope) or not 0 < self.slope <= _MOST_SLOPE:
            raise ValueError(
                f"slope must be above 0 and at most {_MOST_SLOPE:g}, got {shorten(self.slope)}. "
                "Take 1 to leave scores as they are."
            )
        if not is_number(self.offset) or not abs(self.offset) <= _MOST_OFFSET:
            raise ValueError(
                f"offset must lie in {-_MOST_OFFSET:g} to {_MOST_OFFSET:g}, got "
                f"{shorten(self.offset)}. Take 0 to leave scores as they are."
            )

    @classmethod
    def open_vocabulary(cls) -> ScoreCalibration:
        """Return a start for detectors that are given words, such as OWL-ViT or Grounding DINO.

        Their scores are similarities of an image and a text: .1 is the usual threshold, and .3 is
        mostly right. An assumption in round figures, not a measurement: .1 becomes .40, .2 .62, .3
        .74 and .5 .88. Fit your own once there are looks.
        """
        return cls(slope=1.1, offset=2.0)

    @classmethod
    def fit(
        cls, scores: Sequence[float] | np.ndarray, is_right: Sequence[float] | np.ndarray
    ) -> ScoreCalibration:
        """Fit the curve to labelled detections.

        The likeliest curve, where as much as one sighting speaks for scores as they are, so that it
        is one for labels that are all alike, too.

        Args:
            scores: of the detections, between 0 and 1, n of them.
            is_right: whether each was right, or how likely, n of them.

        Raises:
            ValueError: if they are fewer than `FEWEST_SCORES`, not as many, or out of range.
        """
        logits = _compute_logits(_read("scores", scores))
        right = _read("is_right", is_right)
        if len(logits) != len(right):
            raise ValueError(
                f"is_right must be as many as the scores, got {len(right)} for {len(logits)}. Give "
                "one for each."
            )
        if len(logits) < FEWEST_SCORES:
            raise ValueError(
                f"scores must be at least {FEWEST_SCORES}, got {len(logits)}. Take more detections."
            )
        slope, offset = _fit_logistic(logits, right)
        return cls(slope, offset)

    def __call__(self, score: float) -> float:
        """Return the probability that a detection of a score is right."""
        if not 0 < score < 1:
            return float(score)
        logit = float(_compute_logits(np.array([score]))[0])
        return float(_sigmoid(np.array(self.offset + self.slope * logit)))

    def to_json(self) -> dict[str, float]:
        """Return JSON values, from which `from_json` makes the same."""
        return {"slope": float(self.slope), "offset": float(self.offset)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ScoreCalibration:
        """Read JSON values; raises KeyError, TypeError or ValueError if they are none."""
        return cls(data["slope"], data["offset"])


def _read(name: str, values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return numbers from 0 to 1, (n,); `ValueError` for anything else."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        array = np.full(1, np.nan)
    if array.ndim != 1 or not ((array >= 0) & (array <= 1)).all():
        raise ValueError(f"{name} must be numbers from 0 to 1, got {shorten(values)}. Check them.")
    return array


def _compute_logits(scores: np.ndarray) -> np.ndarray:
    scores = np.clip(scores, _LEAST, 1 - _LEAST)
    return np.log(scores) - np.log1p(-scores)


def _sigmoid(values: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(values, -500, 500)))


def _fit_logistic(logits: np.ndarray, right: np.ndarray) -> tuple[float, float]:
    """Return slope and offset of the likeliest curve, by Newton's method with halved steps.

    A slope near 0 says that scores tell nothing; it is kept above it, since a calibration orders
    detections as their scores do.
    """
    features = np.stack([logits, np.ones_like(logits)], axis=1)  # (n, 2)
    start = np.array([1.0, 0.0])

    def compute_loss(values: np.ndarray) -> float:
        margin = features @ values
        loss = np.logaddexp(0, margin) - right * margin
        return float(loss.sum() + 0.5 * _RIDGE * ((values - start) ** 2).sum())

    values, loss = start, compute_loss(start)
    for _ in range(_ROUNDS):
        curve = _sigmoid(features @ values)
        gradient = features.T @ (curve - right) + _RIDGE * (values - start)
        weight = curve * (1 - curve)
        step = np.linalg.solve(
            features.T @ (features * weight[:, None]) + _RIDGE * np.eye(2), gradient
        )
        size = 1.0
        while compute_loss(values - size * step) > loss and size > 1e-6:
            size /= 2
        values = values - size * step
        before, loss = loss, compute_loss(values)
        if before - loss < 1e-10:
            break
    slope, offset = np.clip(values, [1e-3, -_MOST_OFFSET], [_MOST_SLOPE, _MOST_OFFSET])
    return float(slope), float(offset)

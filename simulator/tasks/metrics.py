"""The metrics, one entry each: those that tasks score a step with, and those of their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sgm.messages import shorten
from simulator.tasks.scores import TaskScores
from simulator.world.parts import find_named

# What an answer costs at most in `compute_nll`: 13.8 nats, instead of infinity.
MIN_PROBABILITY = 1e-6


@dataclass(frozen=True, slots=True)
class Metric:
    """A number that says how a policy did.

    Attributes:
        name: key in files.
        title: heading of its column in tables.
        format: how tables write it, such as ".3f".
        is_higher_better: whether a high value is a good one.
        compute: gets what a policy scored and returns the number, nan where nothing was answered.
    """

    name: str
    title: str
    format: str
    is_higher_better: bool
    compute: Callable[[TaskScores], float]

    def by_home(self, scores: TaskScores) -> np.ndarray:
        """Compute it of every home alone, (H,)."""
        return np.array([self.compute(scores.take(home)) for home in range(len(scores.values))])


def compute_accuracy(scores: TaskScores) -> float:
    """Return the mean over homes of the share of right answers."""
    return float(scores.is_correct.mean(axis=1).mean())


def compute_accuracy_among(is_correct: np.ndarray, is_meant: np.ndarray) -> float:
    """Return the share of right answers among some, nan where there is none; bool, one shape."""
    return float(is_correct[is_meant].mean()) if is_meant.any() else float("nan")


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


def _compute_mean(scores: TaskScores) -> float:
    """Return the mean over homes of their mean score per step."""
    return float(scores.home_values.mean())


def _index(*metrics: Metric) -> Mapping[str, Metric]:
    return {metric.name: metric for metric in metrics}


# What tasks score a step with; `Task.metric` names one of them.
STEP_METRICS = _index(
    Metric("accuracy", "accuracy", ".3f", True, _compute_mean),
    Metric("ndcg", "NDCG", ".3f", True, _compute_mean),
    Metric("looks", "looks", ".2f", False, _compute_mean),
)

# What is computed of the answers in every task: columns of tables and CSV files in this order,
# numbers of results. One entry here makes one more.
METRICS = _index(
    Metric("accuracy", "answers right", ".3f", True, compute_accuracy),
    # about objects that have left the place where the agent saw them last
    Metric(
        "away_accuracy",
        "right if away",
        ".3f",
        True,
        lambda scores: compute_accuracy_among(scores.is_correct, scores.is_away),
    ),
    # about objects that are not where they have been most of the time
    Metric(
        "out_of_place_accuracy",
        "right if out of place",
        ".3f",
        True,
        lambda scores: compute_accuracy_among(scores.is_correct, scores.is_out_of_place),
    ),
    Metric(
        "calibration_error",
        "ECE",
        ".3f",
        False,
        lambda scores: compute_calibration_error(
            scores.confidence.ravel(), scores.is_correct.ravel()
        ),
    ),
    Metric("nll", "NLL", ".2f", False, lambda scores: compute_nll(scores.likelihood.ravel())),
    # docs/design.md, ruling 12: near 1
    Metric(
        "candidate_recall", "recall", ".3f", True, lambda scores: float(scores.has_candidate.mean())
    ),
)


def check_metric(metric: Metric, num_homes: int, num_steps: int) -> None:
    """Compute a metric of made-up scores of so many homes and steps, as a trial.

    Raises:
        ValueError: if that is no number.
    """
    number = np.arange(num_homes * num_steps).reshape(num_homes, num_steps)
    half, other = number % 2 == 0, number % 3 == 0  # neither all nor none
    share = np.where(half, 0.75, 0.25)
    scores = TaskScores(share, half, ~other, other, share, share, share + 1, other, number % 24)
    value = metric.compute(scores)
    if isinstance(value, bool) or np.ndim(value) or not isinstance(value, (int, float, np.number)):
        raise ValueError(
            f"metric must return a number for all homes together, got {shorten(value)} of "
            f"{metric.name}. Return a mean, such as float(values.mean())."
        )


def find_metric(name: str) -> Metric:
    """Find a metric of answers by name, or import one of your own: "my_module:my_metric".

    Args:
        name: that name; of one's own, that of a `Metric`, or of a function that gets `TaskScores`
            and returns a number, of which more is better.

    Raises:
        ValueError: if there is no metric of that name.
    """
    found = find_named("metric", name, METRICS, "my_metric")
    if isinstance(found, Metric):
        return replace(found, name=name)
    if not callable(found):
        raise ValueError(
            "metric must be a Metric, or a function of TaskScores, got "
            f"{shorten(name)}, which is {type(found).__name__}. Check the name."
        )
    return Metric(name, name.partition(":")[2], ".3f", True, found)

"""What a look says about where a thing is: Bayes' rule over all places and "elsewhere"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.checks import is_number
from sgm.memory.asking import Looks
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten

SEEN_NOW = 0.97  # a thing seen in this very step is there; detectors err, people walk by


@dataclass(frozen=True, slots=True)
class Detector:
    """What is known of the robot's eyes, and of how fast the home changes.

    A robot's own, told by its user or counted by its memory (`estimate`); what simulated homes
    have, filters are told and memories count is in docs/design.md, agreement "Rates".

    Attributes:
        miss_rate: probability that a look at a place does not show what is there, .25 in the
            paper's homes.
        leave_rate: share of the things that leave their place in a time step, .05 in the paper's
            homes; a negative look of long ago says little.
    """

    miss_rate: float = 0.25
    leave_rate: float = 0.05

    @classmethod
    def estimate(cls, memory: SceneGraphMemory) -> Detector:
        """Return what a memory has counted: looks that missed what later looks found, and moves.

        A miss rate of .2, as of ten looks, and a leave rate of a thirtieth, as of fifteen steps,
        are what it starts from. Things that are easily overlooked are missed again where they were
        missed before, which one rate does not say: give the detector's own where it is known.
        """
        history = memory.batch.history
        return cls(
            float(history.compute_miss_rate()[0]), min(float(history.compute_move_rate()[0]), 0.99)
        )

    def __post_init__(self) -> None:
        """Check both.

        Raises:
            ValueError: if one is no probability, or the miss rate is 1: such looks say nothing.
        """
        for name, value in (("miss_rate", self.miss_rate), ("leave_rate", self.leave_rate)):
            if not is_number(value) or not 0 <= value < 1:
                raise ValueError(
                    f"{name} must lie in [0, 1), got {shorten(value)}. Give a probability: the "
                    "paper's homes have 0.25 and 0.05."
                )


def compute_likelihood(
    looks: Looks, detector: Detector, looks_counted: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely the looks in vain are if the object is at each place, (F,) both.

    A look of this step: the miss rate. One of s steps ago: the object may have come since, so that
    it is 1 - (1 - miss rate) (1 - leave rate)^s.

    Args:
        looks: at every place.
        detector: how reliable they are.
        looks_counted: share of what those of earlier steps say that is in the belief already where
            it was ever seen; the rest is that power of their likelihood.

    Returns:
        That of the looks of earlier steps that were for whatever is there, which the memory keeps
        for all objects; and that of the others: of this step, and for this object alone.
    """
    weight = 1 - looks_counted * looks.is_remembered
    before = 1 - (1 - detector.miss_rate) * _compute_stay(looks.steps_ago, detector)
    sought = 1 - detector.miss_rate**looks.sought
    sought = 1 - sought * _compute_stay(looks.sought_ago, detector)
    return np.prod(before, axis=1) ** weight, detector.miss_rate**looks.in_vain * sought**weight


def _compute_stay(steps: np.ndarray, detector: Detector) -> np.ndarray:
    """Return how likely nothing came to a place in some steps; 0 if they are infinitely many."""
    stay: np.ndarray = np.where(np.isfinite(steps), (1 - detector.leave_rate) ** steps, 0.0)
    return stay


def update_belief(
    places: np.ndarray,
    elsewhere: float,
    looks: Looks,
    detector: Detector,
    looks_counted: float = 0.0,
    elsewhere_counts: bool = False,
) -> tuple[np.ndarray, float]:
    """Update a belief about one object by what was seen and not seen.

    Looks in vain multiply each place by their likelihood, and all is normalised with "elsewhere",
    which they leave alone: Bayes' rule. What was seen in this step is there with its confidence, at
    most `SEEN_NOW`; the rest keeps its proportions.

    Args:
        places: probability of each place, (F,); sums to 1 - elsewhere.
        elsewhere: probability that it is at none of them.
        looks: what was seen and not seen.
        detector: how reliable that is.
        looks_counted: as in `compute_likelihood`.
        elsewhere_counts: whether `elsewhere` counts the looks of earlier steps already, but for
            those for this object alone: then they say which places are likelier, and no more.

    Returns:
        Probability of each place, (F,), and of "elsewhere". They sum to one, unless several of the
        kind were seen at once: then each place has the probability that one of them is there.
    """
    before, since = compute_likelihood(looks, detector, looks_counted)
    likely = places * before
    if elsewhere_counts and likely.sum() > 0:
        likely *= places.sum() / likely.sum()
    likely = likely * since
    total = likely.sum() + elsewhere
    if total > 0:
        likely, elsewhere = likely / total, elsewhere / total
    seen = np.minimum(looks.seen, SEEN_NOW)
    if not seen.any():
        return likely, float(elsewhere)
    missing = float(np.prod(1 - seen))  # no sighting was right
    rest = np.where(seen > 0, 0.0, likely)
    left = rest.sum() + elsewhere
    share = missing / left if left > 0 else 0.0
    return np.where(seen > 0, seen, rest * share), float(elsewhere * share)


def join_beliefs(places: np.ndarray, elsewhere: np.ndarray) -> tuple[np.ndarray, float]:
    """Return where any of K objects is, given where each of them may be.

    Args:
        places: probability of each place for each object, (K, F).
        elsewhere: that an object is at none of them, (K,).

    Returns:
        Probability that at least one of them is at each place, (F,), and that none is at any.
    """
    if len(places) == 1:
        return places[0], float(elsewhere[0])
    return 1 - np.prod(1 - places, axis=0), float(np.prod(elsewhere))

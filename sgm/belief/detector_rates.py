"""How far looks can be believed: the rates of a detector, and the likelihood of what it showed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from sgm.checks import is_number
from sgm.memory.home_history import HomeHistory
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.seen_places import Looks
from sgm.messages import shorten

# Looks that the usual miss rate counts as beside a robot's own count, which is a little low: what
# is missed for long is often elsewhere when it is seen again.
USUAL_LOOKS = 30.0
OTHER_STEPS = 0.1  # correlation of misses in two time steps: half of what a step repeats
_MOST_STEPS = 100  # of looks that are kept apart: so many leave less than one in a million
SEEN_NOW = 0.97  # probability of the place at which a thing was seen in this step: detectors err


@dataclass(frozen=True, slots=True)
class Detector:
    """What is known of the robot's eyes.

    A look is a visit: all that was seen of a place from where one stands, in however many frames.
    What a visit does not show, another one a moment later mostly does not show either: the thing
    is hidden, or the detector has another name for it.

    A robot's own, given by its user or counted by its memory (`estimate`); docs/design.md,
    agreement "Rates", says which rates there are besides.

    Attributes:
        miss_rate: probability that a look at a place does not show what is there, .25 in the
            paper's homes.
        repeated_share: share of the misses that another look in the same time step repeats. 0 where
            looks are independent, such as frames of a moving camera and a detector that flickers;
            1 where a second look says nothing new. The default is an assumption.
        counted: looks of the memory that missed a thing, and all of them, from which the miss rate
            was learnt; zeros where it is assumed or given.
    """

    miss_rate: float = 0.25
    repeated_share: float = 0.95
    counted: tuple[float, float] = field(default=(0.0, 0.0), compare=False, repr=False)

    @classmethod
    def estimate(cls, memory: SceneGraphMemory, usual: Detector | None = None) -> Detector:
        """Return the miss rate of a memory's own count, joined with the usual one.

        Counted are looks that missed what later looks found at the same place. The usual rate,
        before anything was counted (None for the default), counts as thirty such looks, since
        the count takes no notice of what was missed and then moved. `print` says it in words.
        """
        return cls.learn(memory.batch.history, usual or cls())

    @classmethod
    def learn(cls, history: HomeHistory, usual: Detector) -> Detector:
        """Return what `estimate` does, of the counts of a single home."""
        missed, found = (float(history.counters[name][0]) for name in ("num_missed", "num_refound"))
        return _join_counts(usual, missed, missed + found)

    def __str__(self) -> str:
        """Say it in words."""
        missed, looks = self.counted
        source = f", learnt from {looks:.0f} looks that missed {missed:.0f}" if looks >= 1 else ""
        return (
            f"a look misses {self.miss_rate:.0%} of what is there{source}; another look in the "
            f"same step repeats {self.repeated_share:.0%} of the misses"
        )

    def __post_init__(self) -> None:
        """Check all of them.

        Raises:
            ValueError: if one is no probability, or the miss rate is 1: such looks say nothing.
        """
        if not is_number(self.miss_rate) or not 0 <= self.miss_rate < 1:
            raise ValueError(
                f"miss_rate must lie in [0, 1), got {shorten(self.miss_rate)}. Give a probability: "
                "the paper's homes have 0.25."
            )
        if not is_number(self.repeated_share) or not 0 <= self.repeated_share <= 1:
            raise ValueError(
                f"repeated_share must lie in [0, 1], got {shorten(self.repeated_share)}. Give a "
                "share of the misses: 0 where looks are independent."
            )

    @property
    def miss_again(self) -> float:
        """How likely a look misses a thing that is there and can be seen: (m - h) / (1 - h).

        With m the miss rate and h = `repeated_share` m the things that all looks miss. The chance
        that one more look is the first to show a thing falls by this factor from look to look.
        """
        hidden = self.repeated_share * self.miss_rate
        return (self.miss_rate - hidden) / (1 - hidden)

    def compute_miss(self, num_looks: np.ndarray) -> np.ndarray:
        """Return how likely looks of one time step all miss what is there; see `compute_miss`."""
        return compute_miss(num_looks, self.miss_rate, self.repeated_share)

    def compute_detection(self, num_looks: np.ndarray) -> np.ndarray:
        """Return how likely one more look shows a thing that is there.

            detection(n) = 1 - miss(n + 1) / miss(n)

        with n looks at the place in this time step that missed it, an array of any shape. It falls
        with n, since a thing that was missed often is more likely to be hidden.
        """
        num_looks = np.asarray(num_looks, dtype=float)
        if num_looks.size > 1 and not num_looks.any():  # mostly: one number for all
            return np.full(num_looks.shape, self.compute_detection(np.zeros(1))[0])
        before, after = self.compute_miss(np.stack([num_looks, num_looks + 1]))
        missed: np.ndarray = np.divide(after, before, out=np.ones_like(before), where=before > 0)
        return 1 - missed

    def weigh_seen(self, looks: Looks) -> np.ndarray:
        """Return how likely it is where it was seen in this step, 0 where it was not, (..., F).

        The confidence of the sighting, at most `SEEN_NOW`, and Bayes' rule for looks
        since that did not show it. What was seen in this step is not hidden: they miss it
        independently.
        """
        if not looks.seen.any():
            return np.zeros(looks.seen.shape)
        seen = np.minimum(looks.seen, SEEN_NOW)
        missed = seen * compute_miss(looks.negative, self.miss_rate, 0.0)
        weighed: np.ndarray = missed / (missed + 1 - seen)
        return weighed


@lru_cache(maxsize=64)  # one for each state of a memory, which many questions ask
def _join_counts(usual: Detector, missed: float, looks: float) -> Detector:
    """Return a detector whose looks, beside the usual ones, missed so many."""
    rate = (missed + USUAL_LOOKS * usual.miss_rate) / (looks + USUAL_LOOKS)
    return replace(usual, miss_rate=rate, counted=(missed, looks))


def compute_miss(
    num_looks: np.ndarray, miss_rate: np.ndarray | float, repeated_share: float
) -> np.ndarray:
    """Return how likely n looks at a place in one time step all miss a thing that is there.

    A part h = repeated_share miss_rate of the things is missed by all of them, the others by each
    look anew:

        miss(n) = h + (1 - h) i^n,  where miss(1) = miss_rate

    A look at a part of a place counts as that part of a look: miss(n) is linear between whole n,
    so that one look with coverage c has 1 - c (1 - miss_rate). Numbers of looks have any shape, and
    the miss rate of one look has that shape, too, or is one number.
    """
    hidden = repeated_share * miss_rate
    anew = (miss_rate - hidden) / (1 - hidden)
    whole = np.floor(num_looks)
    before, after = (
        np.where(n > 0, hidden + (1 - hidden) * anew**n, 1.0) for n in (whole, whole + 1)
    )
    missed: np.ndarray = before + (num_looks - whole) * (after - before)
    return missed


def compute_miss_over_steps(num_looks: np.ndarray, miss_rate: np.ndarray) -> np.ndarray:
    """Return how likely n looks, each in a time step of its own, all miss a thing that is there.

    Some things are harder to see than others. The miss rate of each is drawn from a beta
    distribution of mean m, the miss rate of all, and misses in two steps are correlated by
    c = `OTHER_STEPS`:

        miss(n) = Π (m s + k) / (s + k),  k = 0 ... n - 1,  where s = 1 / c - 1

    Args:
        num_looks: n, whole numbers, (Q, F).
        miss_rate: m, (Q, 1).
    """
    strength = 1 / OTHER_STEPS - 1
    before = np.arange(_MOST_STEPS)
    missed = np.ones((len(num_looks), _MOST_STEPS + 1))
    again = (miss_rate * strength + before) / (strength + before)
    np.cumprod(again, axis=1, out=missed[:, 1:])
    return np.take_along_axis(missed, np.minimum(num_looks, _MOST_STEPS), axis=1)

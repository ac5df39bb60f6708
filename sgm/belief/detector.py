"""How far looks can be believed: the rates of a detector, and the likelihood of what it showed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sgm.belief.corrections import CORRECTIONS
from sgm.checks import is_number
from sgm.memory.asking import Looks
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten


@dataclass(frozen=True, slots=True)
class Detector:
    """What is known of the robot's eyes, and of how fast the home changes.

    A robot's own, given by its user or counted by its memory (`estimate`); docs/design.md,
    agreement "Rates", says which rates there are besides.

    Attributes:
        miss_rate: probability that a look at a place does not show what is there, .25 in the
            paper's homes.
        leave_rate: share of the things that leave their place in a time step, .05 in the paper's
            homes; a negative look of long ago says little.
        repeated_share: share of the misses that another look in the same time step repeats: the
            thing is hidden, or the detector has another name for it. 0 where looks are independent,
            1 where a second look says nothing new.
    """

    miss_rate: float = 0.25
    leave_rate: float = 0.05
    repeated_share: float = CORRECTIONS.repeated_share

    @classmethod
    def estimate(cls, memory: SceneGraphMemory, usual: Detector | None = None) -> Detector:
        """Return the miss rate of a memory's own count, joined with the usual one.

        Counted are looks that missed what later looks found at the same place. The usual rate,
        before anything was counted (None for the default), counts as a thousand such looks, since
        the count takes no notice of what was missed and then moved. The leave rate stays as it is:
        how often things are found moved does not say how often something comes to a place, and
        answers got worse with it in all homes tried.
        """
        usual = usual or cls()
        counted = {name: float(column[0]) for name, column in memory.batch.history.counters.items()}
        looks = counted["num_missed"] + counted["num_refound"]
        missed = counted["num_missed"] + CORRECTIONS.usual_looks * usual.miss_rate
        return replace(usual, miss_rate=missed / (looks + CORRECTIONS.usual_looks))

    def __post_init__(self) -> None:
        """Check all of them.

        Raises:
            ValueError: if one is no probability, or a rate is 1: such looks say nothing.
        """
        for name, value in (("miss_rate", self.miss_rate), ("leave_rate", self.leave_rate)):
            if not is_number(value) or not 0 <= value < 1:
                raise ValueError(
                    f"{name} must lie in [0, 1), got {shorten(value)}. Give a probability: the "
                    "paper's homes have 0.25 and 0.05."
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

        The confidence of the sighting, at most `CORRECTIONS.seen_now`, and Bayes' rule for looks
        since that did not show it.
        """
        if not looks.seen.any():
            return np.zeros(looks.seen.shape)
        seen = np.minimum(looks.seen, CORRECTIONS.seen_now)
        missed = seen * self.compute_miss(looks.negative)
        weighed: np.ndarray = missed / (missed + 1 - seen)
        return weighed

    def compute_log_likelihood(
        self, looks: Looks, looks_counted: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the log likelihood of negative looks if a thing is at each place, (V, F) both.

        Looks of this step all miss it with `compute_miss`. After one of s steps ago the object may
        have come, so that its likelihood is 1 - (1 - miss rate) (1 - leave rate)^s.

        Args:
            looks: at every place, of V objects.
            looks_counted: share of what looks of earlier steps say that is in the belief already
                where the object was ever seen; the rest is that power of their likelihood.

        Returns:
            That of the looks of earlier steps that were for whatever is there, which the memory
            keeps for all objects; and that of the others: of this step, and for this object alone.
        """
        weight = 1 - looks_counted * looks.is_remembered
        counts = weight > 0
        remains = 1 - self.leave_rate
        stay = remains**looks.steps_ago * (np.isfinite(looks.steps_ago) & counts[..., None])
        stay_sought = remains**looks.sought_ago * (np.isfinite(looks.sought_ago) & counts)
        sought_missed = self.compute_miss(looks.sought)
        with np.errstate(divide="ignore"):  # a look that misses nothing rules out what has stayed
            earlier = weight * np.log(1 - (1 - self.miss_rate) * stay).sum(axis=-1)
            alone = np.log(self.compute_miss(looks.negative))
            alone += weight * np.log(1 - (1 - sought_missed) * stay_sought)
        return earlier, alone


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
    here, next_one = (
        np.where(n > 0, hidden + (1 - hidden) * anew**n, 1.0) for n in (whole, whole + 1)
    )
    missed: np.ndarray = here + (num_looks - whole) * (next_one - here)
    return missed

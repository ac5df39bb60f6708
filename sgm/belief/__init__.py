"""Where things may be: one algebra of beliefs, and what looks say about them."""

from sgm.belief.detector_rates import SEEN_NOW, Detector, compute_miss, compute_miss_over_steps
from sgm.belief.posterior import Belief, Posterior, compute_posterior
from sgm.belief.stay import compute_stay

__all__ = [
    "SEEN_NOW",
    "Belief",
    "Detector",
    "Posterior",
    "compute_miss",
    "compute_miss_over_steps",
    "compute_posterior",
    "compute_stay",
]

"""Where things may be: one algebra of beliefs, and what looks say about them."""

from sgm.belief.belief import Belief
from sgm.belief.corrections import CORRECTIONS, Corrections
from sgm.belief.detector import Detector, compute_miss

__all__ = ["CORRECTIONS", "Belief", "Corrections", "Detector", "compute_miss"]

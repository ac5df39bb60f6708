"""Where things may be: one algebra of beliefs, and what looks say about them."""

from sgm.belief.belief import SEEN_NOW, Belief
from sgm.belief.detector import REPEATED_SHARE, Detector, compute_miss

__all__ = ["REPEATED_SHARE", "SEEN_NOW", "Belief", "Detector", "compute_miss"]

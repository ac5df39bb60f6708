"""Colours that mean the same in every picture, and how a probability is shaded."""

from __future__ import annotations

import numpy as np

BELIEF, TRUE_PLACE, ROUTE = "#f07820", "#d6166c", "#2060c8"
SAID = "#7a4fb5"
SEEN, MISSING = "#1f77b4", "#d62728"  # at the last look at its place


def compute_shade(probability: np.ndarray | float) -> np.ndarray:
    """Return how strongly probabilities are coloured, (n,); small ones show, too."""
    shade: np.ndarray = np.sqrt(np.clip(probability, 0, 1))
    return shade

"""How likely a thing of a home is where it was."""

from __future__ import annotations

import numpy as np

from sgm.memory.memory_batch import MemoryBatch


def compute_stay(memory: MemoryBatch, steps: np.ndarray) -> np.ndarray:
    """Return how likely a thing of a home stays where it is for some time steps, of any shape.

    At the rate at which things were found moved there (`HomeHistory.compute_move_rate`).
    """
    seconds = np.nan if memory.clock is None else float(memory.clock[0, 1])
    hours = 1.0 if np.isnan(seconds) else seconds / 3600
    rate = float(memory.history.compute_move_rate(hours)[0])
    stay: np.ndarray = np.exp(-rate * hours * steps)
    return stay

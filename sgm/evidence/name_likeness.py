"""How much the names of things are alike."""

from __future__ import annotations

import numpy as np

from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.text.vectors import compare

_WIDTH = 0.1  # of cosines by which the names of two things are alike


def compare_names(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return how much each label of a memory is like what is asked for, 1 for itself, (Q, L)."""
    asked = [memory.labels[label] for label in memory.objects["label"][queries.object].tolist()]
    likeness: np.ndarray = np.exp((compare(asked, memory.labels) - 1) / _WIDTH)
    return likeness

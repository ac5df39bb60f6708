"""What a look has changed in the memories of many homes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Change:
    """Rows that one look has changed or made.

    Attributes:
        home: homes that looked, (n,).
        furniture: furniture index looked at, (n,).
        objects: rows of `MemoryBatch.objects`.
        edges: rows of `MemoryBatch.edges`.
        is_seen: whether the look found each of these edges true, bool, as long as `edges`.
        coverage: share of the furniture that was in view, (n,).
    """

    home: np.ndarray
    furniture: np.ndarray
    objects: np.ndarray
    edges: np.ndarray
    is_seen: np.ndarray
    coverage: np.ndarray

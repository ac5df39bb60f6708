"""What the parts of a memory read of it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from sgm.arrays.table import Table
from sgm.memory.queries import Queries
from sgm.prior.place_prior import PlacePrior


class Remembered(Protocol):
    """The state of H homes that a look is weighed and counted against; see `MemoryBatch`."""

    time: int
    clock: np.ndarray | None
    objects: Table
    edges: Table
    place_prior: PlacePrior

    @property
    def furniture_num_observed(self) -> np.ndarray:
        """Looks at each furniture node so far, (H, F)."""

    @property
    def num_homes(self) -> int:
        """H."""

    @property
    def num_furniture(self) -> int:
        """F of the largest home."""

    def edges_of(self, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
        """Return query and row of every remembered edge of the objects asked for, (n,) each."""

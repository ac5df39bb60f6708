"""Questions to the memories of many homes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Queries:
    """Objects that are asked for, one per entry; a home may have several.

    Attributes:
        home: home index, (Q,).
        object: row of the query object in `MemoryBatch.objects`, (Q,).
        prior: prior weight of each place for it, float32 (Q, F, 2).
    """

    home: np.ndarray
    object: np.ndarray
    prior: np.ndarray

    def join(self, others: Queries) -> Queries:
        """Return these queries, and others after them."""
        return Queries(
            np.append(self.home, others.home),
            np.append(self.object, others.object),
            np.concatenate([self.prior, others.prior]),
        )

    def take(self, rows: np.ndarray) -> Queries:
        """Return some of the queries, (n,)."""
        return Queries(self.home[rows], self.object[rows], self.prior[rows])

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
        more_asked: how many more questions than the memory has counted were put when each was, of
            questions that are answered in one pass though they were put apart, (Q,); None for 0.
    """

    home: np.ndarray
    object: np.ndarray
    prior: np.ndarray
    more_asked: np.ndarray | None = None

    def join(self, others: Queries) -> Queries:
        """Return these queries, and others after them."""
        both, more = (self, others), None
        if any(one.more_asked is not None for one in both):
            none = [np.zeros(len(one.home), dtype=np.int64) for one in both]
            counts = zip((one.more_asked for one in both), none, strict=True)
            more = np.concatenate([own if given is None else given for given, own in counts])
        return Queries(
            np.append(self.home, others.home),
            np.append(self.object, others.object),
            np.concatenate([self.prior, others.prior]),
            more,
        )

    def take(self, rows: np.ndarray) -> Queries:
        """Return some of the queries, (n,)."""
        more = None if self.more_asked is None else self.more_asked[rows]
        return Queries(self.home[rows], self.object[rows], self.prior[rows], more)

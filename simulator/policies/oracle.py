"""The paper's Oracle: last seen unless absent, falling back on the true dynamics."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS, sum_relations
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.heuristics import LastSeenUnlessAbsent
from simulator.world.homes import Homes
from simulator.world.source import TRUE_TRANSITIONS


class Oracle(LastSeenUnlessAbsent):
    """The same rule, falling back on the home's true dynamics T.

    Source: paper section 5.3: "ground truth knowledge about the dynamics" and a "memory of past
    observed object locations"; docs/design.md, ruling 20. `Ceiling` is how good an answer can be.
    """

    needs: ClassVar[frozenset[str]] = frozenset((TRUE_TRANSITIONS,))

    def __init__(self, homes: Homes) -> None:
        """Keep the true homes."""
        self._homes = homes

    @classmethod
    def make(cls, homes: Homes) -> Oracle:
        """Keep the true homes."""
        return cls(homes)

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the row of T, (Q, F)."""
        codes = memory.objects["key"][queries.object]
        rows = self._homes.transition_rows(queries.home, codes)
        return sum_relations(rows.reshape(len(rows), -1, NUM_RELATIONS)).astype(float)

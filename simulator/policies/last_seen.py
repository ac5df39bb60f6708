"""Last seen unless absent: the strongest cheap rule, and the paper's Oracle built on it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simulator.arrays.relations import max_relations, sum_relations
from simulator.memory.columns import NEVER
from simulator.memory.memory_batch import MemoryBatch
from simulator.memory.queries import Queries
from simulator.policies.policy import Policy, mask_furniture, spread_over_furniture
from simulator.world.homes import NUM_RELATIONS, Homes
from simulator.world.source import TRUE_TRANSITIONS


class LastSeenUnlessAbsent(Policy):
    """The last seen place, unless that place has been seen without the object since.

    Then the places ranked by how often the object was seen there, those that were recently seen
    without it last.
    """

    recent_steps = 10  # "recently": at 5 % moves a step, half of what was there has moved on

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return 2 for a trusted last place, otherwise weights in [0, 1], (Q, F)."""
        never = np.full((len(queries.home), memory.num_furniture, NUM_RELATIONS), NEVER)
        true_at = memory.edges["last_true"]
        last_true = max_relations(
            spread_over_furniture(memory, queries, true_at.__getitem__, never)
        )
        last_look = memory.furniture_last_observed[queries.home]
        is_absent = (last_look > last_true) & (last_look != NEVER)
        is_empty = is_absent & (memory.time - last_look <= self.recent_steps)
        weights = self.compute_weights(memory, queries)
        scores = np.where(is_empty, weights * 1e-3, weights)
        last = memory.objects["last_furniture"][queries.object]
        trusted = np.flatnonzero(last != NEVER)
        trusted = trusted[~is_absent[trusted, last[trusted]]]
        scores[trusted, last[trusted]] = 2.0
        return mask_furniture(memory, queries, scores)

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the weight of each furniture node where the last place is not trusted, (Q, F)."""
        none = np.zeros((len(queries.home), memory.num_furniture, NUM_RELATIONS))
        num_true = memory.edges["num_true"]
        counts = sum_relations(spread_over_furniture(memory, queries, num_true.__getitem__, none))
        return (counts + 0.5) / (counts.sum(axis=1, keepdims=True) + 1)


class LastSeenUnlessAbsentPrior(LastSeenUnlessAbsent):
    """The same rule, falling back on the prior."""

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the prior, (Q, F)."""
        return sum_relations(queries.prior).astype(float)


class Oracle(LastSeenUnlessAbsent):
    """The same rule, falling back on the home's true dynamics T.

    Source: paper section 5.3: "ground truth knowledge about the dynamics" and a "memory of past
    observed object locations"; docs/design.md, ruling 20. `Ceiling` is what an answer can be worth.
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

"""Last seen unless absent: the strongest cheap rule."""

from __future__ import annotations

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS, max_relations, sum_relations
from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.policy import Policy, mask_furniture, spread_over_furniture


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

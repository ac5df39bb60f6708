"""HomeFilter: a Bayes filter that starts from the prior and learns which places a home uses."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simulator.memory.memory_batch import MemoryBatch, Queries
from simulator.policies.filters import Belief, PriorFilter, Rules

_MOST_CERTAIN = 0.98  # that a look would have found the object: no single look rules out a home
_LEAST_POSSIBLE = 0.02


class HomeFilter(PriorFilter):
    """The filter that knows the rules and learns the home's own version of the prior.

    Class and instance noise each rule out a place of the prior with `noise_zero_prob`. The filter
    follows, per description and furniture node, the probability that the place is possible: one
    once the object was seen there; higher where another object of its type was seen at such
    furniture of the room, whose class weight then is not zero; lower with each look that did not
    find the object there, by Bayes' rule, although it was expected. Objects move in proportion to
    the prior times this probability. Places are taken to be independent, and the scale of the
    noise is left out.

    Source: paper appendix A, "Sampling noise"; rulings 5 and 6.
    """

    learns: ClassVar[bool] = True

    def start(self, memory: MemoryBatch, queries: Queries, rules: Rules) -> Belief:
        """Return the belief at t = 0 of an agent that knows what was ever seen where."""
        possible = self._compute_possible(memory, queries)
        expected = rules.initial * possible
        total = expected.sum(axis=1, keepdims=True)
        scale = np.divide(
            rules.initial.sum(axis=1, keepdims=True), total, out=np.ones_like(total),
            where=total > 0,
        )  # fmt: skip
        return Belief(np.zeros(possible.shape), expected * scale, possible)

    def weigh(self, rules: Rules, belief: Belief) -> np.ndarray:
        """Return the prior at places that are possible, (Q, F)."""
        weight = rules.moves * belief.possible
        total = weight.sum(axis=1, keepdims=True)
        return np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)

    def learn(self, belief: Belief, at: np.ndarray, seen: np.ndarray) -> None:
        """Doubt a place where the object was expected and not seen; be sure of one where it was."""
        belief.possible[seen, at[seen]] = 1.0
        q = np.flatnonzero((at >= 0) & ~seen)
        f = at[q]
        possible = belief.possible[q, f]
        # P(not seen | possible) = 1 - found / possible, P(not seen | impossible) = 1.
        found = np.minimum(belief.last[q, f] + belief.others[q, f], _MOST_CERTAIN)
        found = np.minimum(found * (1 - self._config.detection_error), 0.95 * possible)
        doubted = np.maximum((possible - found) / (1 - found), _LEAST_POSSIBLE)
        belief.possible[q, f] = np.where(possible < 1, doubted, 1.0)

    def _compute_possible(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return how likely each place is possible, given what was ever seen where, (Q, F)."""
        survives = 1 - self._config.noise_zero_prob
        is_used = self._find_used_by_type(memory, queries)
        possible = np.where(is_used, survives, survives**2)
        query, edge = memory.edges_of(queries)
        was_seen = memory.edges["num_true"][edge] > 0
        possible[query[was_seen], memory.edges["furniture"][edge[was_seen]]] = 1.0
        possible[memory.objects["type"][queries.object] < 0] = 1.0  # no prior to doubt
        return possible

    def _find_used_by_type(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Mark furniture whose label and room were seen to hold an object of the type, (Q, F)."""
        edges = memory.edges
        true = np.flatnonzero(edges["num_true"] > 0)
        home, furniture = edges["home"][true], edges["furniture"][true]
        types = memory.objects["type"][edges["object"][true]]
        room, label = memory.furniture_room, memory.furniture_label  # (H, F)
        shape = (memory.num_homes, len(self._move_freq) + 1, room.max() + 1, label.max() + 1)
        is_used = np.zeros(shape, dtype=bool)  # unknown types, -1, share the last row
        is_used[home, types, room[home, furniture], label[home, furniture]] = True
        asked = memory.objects["type"][queries.object][:, None]
        at = queries.home[:, None]
        return is_used[at, asked, room[queries.home], label[queries.home]]

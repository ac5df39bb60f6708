"""HomeFilter: a Bayes filter that starts from the prior and learns which places a home uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.memory.memory_batch import MemoryBatch, Queries
from simulator.policies.filters import Belief, Flow, Look, PriorFilter, Rules, find_seen

# No single look and no number of them rules out a place for good: the densities are approximate.
_MOST_CERTAIN = 0.95
_LEAST_POSSIBLE = 0.02
_MOST_EXPECTED = 3.0


@dataclass(slots=True)
class HomeBelief(Belief):
    """What `HomeFilter` believes about each queried object.

    Attributes:
        type_possible: probability that class noise has left the place to the object's type, (Q, F).
        own_possible: probability that instance noise has left the place to the description, given
            that it is left to the type, (Q, F).
        unseen: expected number of objects of the type that were never seen, (Q, F).
        group: number of each furniture node's room and label, which share class noise, (Q, F).
        sameness: probability that an object of the type has the description, (Q,).
    """

    type_possible: np.ndarray
    own_possible: np.ndarray
    unseen: np.ndarray
    group: np.ndarray
    sameness: np.ndarray

    def stack(self) -> np.ndarray:
        """Return last, others, type_possible and own_possible as columns, float32 (Q, F, 4)."""
        columns = [self.last, self.others, self.type_possible, self.own_possible]
        return np.stack(columns, axis=2).astype(np.float32)


class HomeFilter(PriorFilter):
    """The filter that knows the rules and learns the home's own version of the prior.

    Class noise and instance noise each rule out a place of the prior with `noise_zero_prob`. The
    filter follows how likely a place has survived both, and lets objects move in proportion to the
    prior times that:

    - A place where the description was seen has survived both; where another object of the type
      was seen, in the room at furniture of the label, it has survived class noise.
    - A look that finds no object of the type, although m were expected if the place is possible,
      lowers the odds of all furniture of that label in the room by exp(-m).
    - A look that does not find the object, although it was believed to be there, lowers what
      instance noise has left, by Bayes' rule.

    Places are taken to be independent, and the scale of the noise is left out.

    Source: paper appendix A, "Sampling noise"; docs/design.md, rulings 5 and 6.
    """

    learns: ClassVar[bool] = True

    def follow(self, memory: MemoryBatch, queries: Queries) -> HomeBelief:
        """Play the looks so far again for the objects asked for, (Q, F)."""
        belief = super().follow(memory, queries)
        assert isinstance(belief, HomeBelief)
        return belief

    def start(self, memory: MemoryBatch, queries: Queries, rules: Rules) -> HomeBelief:
        """Return the belief at t = 0 of an agent that knows what was ever seen where."""
        survives = 1 - self._config.noise_zero_prob
        types = memory.objects["type"][queries.object]
        group = self._number_groups(memory)
        type_possible = np.where(self._find_used(memory, queries, group), 1.0, survives)
        own_possible = np.full(type_possible.shape, survives)
        query, edge = memory.edges_of(queries)
        was_seen = memory.edges["num_true"][edge] > 0
        own_possible[query[was_seen], memory.edges["furniture"][edge[was_seen]]] = 1.0
        type_possible[types < 0] = own_possible[types < 0] = 1.0  # no prior to doubt
        expected = rules.initial * type_possible * own_possible
        scale = _divide(rules.initial.sum(axis=1), expected.sum(axis=1))
        return HomeBelief(
            last=np.zeros(expected.shape),
            others=expected * scale[:, None],
            type_possible=type_possible,
            own_possible=own_possible,
            unseen=self._expected[queries.home, np.maximum(types, 0)],
            group=group[queries.home],
            sameness=self._sameness[np.maximum(types, 0)],
        )

    def make_flows(self, rules: Rules, belief: Belief, room: np.ndarray) -> tuple[Flow, ...]:
        """Return where the description's objects go, and where those of the type go."""
        assert isinstance(belief, HomeBelief)
        for_type = rules.moves * belief.type_possible
        return tuple(
            self.make_flow(weight, _divide(1.0, weight.sum(axis=1)), room)
            for weight in (for_type * belief.own_possible, for_type)
        )

    def predict(
        self, belief: Belief, rules: Rules, rate: np.ndarray, flows: tuple[Flow, ...],
        room: np.ndarray,
    ) -> None:  # fmt: skip
        """Let one step pass, in place."""
        assert isinstance(belief, HomeBelief)
        super().predict(belief, rules, rate, flows, room)
        coming = rules.add_rate / belief.sameness
        belief.unseen = self.spread(belief.unseen, flows[1], rules, rules.move_rate, coming, room)

    def correct(self, belief: Belief, memory: MemoryBatch, queries: Queries, look: Look) -> None:
        """Fold one look per home into the belief, in place."""
        assert isinstance(belief, HomeBelief)
        at = look.furniture[queries.home]
        is_seen = find_seen(look, queries)
        types = memory.objects["type"][queries.object]
        is_type_seen = look.is_type_seen[queries.home, types]
        self.doubt_type(belief, at, is_type_seen)
        self.doubt_own(belief, at, is_seen)
        super().correct(belief, memory, queries, look)

    def doubt_type(self, belief: HomeBelief, at: np.ndarray, is_type_seen: np.ndarray) -> None:
        """Learn about class noise from one look per query, in place.

        Args:
            belief: what is believed.
            at: furniture looked at, or -1, (Q,).
            is_type_seen: whether an object of the type was seen there, bool (Q,).
        """
        from simulator.compiled.filters import doubt_type  # loads numba

        doubt_type(
            belief.type_possible, belief.unseen, belief.group, at, is_type_seen,
            self._config.detection_error, _LEAST_POSSIBLE, _MOST_EXPECTED,
        )  # fmt: skip

    def doubt_own(self, belief: HomeBelief, at: np.ndarray, is_seen: np.ndarray) -> None:
        """Learn about instance noise from one look per query, in place.

        Args:
            belief: what is believed; before this look is folded into the places.
            at: furniture looked at, or -1, (Q,).
            is_seen: whether the object was seen there, bool (Q,).
        """
        from simulator.compiled.filters import doubt_own  # loads numba

        q = np.arange(len(at))
        doubt_own(
            belief.own_possible, belief.type_possible, belief.last[q, at] + belief.others[q, at],
            at, is_seen, self._config.detection_error, _LEAST_POSSIBLE, _MOST_CERTAIN,
        )  # fmt: skip

    def _number_groups(self, memory: MemoryBatch) -> np.ndarray:
        """Number the pairs of room and furniture label, (H, F)."""
        return memory.furniture_room * (memory.furniture_label.max() + 1) + memory.furniture_label

    def _find_used(self, memory: MemoryBatch, queries: Queries, group: np.ndarray) -> np.ndarray:
        """Mark furniture whose group was ever seen to hold an object of the type, (Q, F)."""
        edges = memory.edges
        true = np.flatnonzero(edges["num_true"] > 0)
        home = edges["home"][true]
        types = memory.objects["type"][edges["object"][true]]
        shape = (memory.num_homes, len(self._move_freq) + 1, group.max() + 1)
        is_used = np.zeros(shape, dtype=bool)  # unknown types, -1, share the last row
        is_used[home, types, group[home, edges["furniture"][true]]] = True
        asked = memory.objects["type"][queries.object]
        return is_used[queries.home[:, None], asked[:, None], group[queries.home]]


def _divide(numerator: np.ndarray | float, denominator: np.ndarray) -> np.ndarray:
    """Divide; 1 where the denominator is zero."""
    return np.divide(numerator, denominator, out=np.ones_like(denominator), where=denominator > 0)

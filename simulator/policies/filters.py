"""Bayes filters over an object's place: by the prior, by what a home uses of it, by the true T."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sgm.arrays.grouped import sum_relations, sum_rows
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.schema import NUM_RELATIONS
from simulator.policies.filter_kernel import OWN_POSSIBLE, TYPE_POSSIBLE, UNSEEN, Rules, Subjects
from simulator.policies.place_filter import PlaceFilter
from simulator.world.homes import Homes
from simulator.world.source import TRUE_PLACE_WEIGHTS, TRUE_TRANSITIONS

if TYPE_CHECKING:
    from typing_extensions import Self


class PriorFilter(PlaceFilter):
    """The filter that takes the prior for the home's dynamics and knows the rules.

    It knows the move rate by type, that moves stay in the room, and the detection error.
    """

    @classmethod
    def make(cls, homes: Homes) -> Self:
        """Make the filter that knows the rules of the homes, not their state."""
        return cls(homes.prior, homes.configs)

    def read_moves(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the prior, (Q, F)."""
        return sum_relations(queries.prior).astype(float)

    def read_type_moves(
        self, memory: MemoryBatch, home: np.ndarray, types: np.ndarray
    ) -> np.ndarray:
        """Return the prior, (n, F)."""
        return sum_relations(memory.place_prior.rows(home, types)).astype(float)

    def compute_rules(self, subjects: Subjects) -> Rules:
        """Return rules with the prior as dynamics, the same everywhere where it knows nothing."""
        rules = super().compute_rules(subjects)
        is_unknown = ((subjects.type < 0) | ~subjects.moves.any(axis=1))[:, None]
        num_furniture = self._num_furniture[subjects.home][:, None]
        alike = (np.arange(subjects.moves.shape[1]) < num_furniture) / num_furniture
        moves, initial = (
            np.where(is_unknown, alike, known) for known in (rules.moves, rules.initial)
        )
        return rules._replace(moves=moves, initial=initial)


class Ceiling(PlaceFilter):
    """The filter over the home's true dynamics T: how good an answer can be.

    Exact for a description with a single instance; with several, it approximates. A description
    that is asked for late in a long life, when the log of looks was cut before, starts from what
    is expected of its type.

    Source: docs/design.md, ruling 20.
    """

    needs: ClassVar[frozenset[str]] = frozenset((TRUE_TRANSITIONS, TRUE_PLACE_WEIGHTS))

    def __init__(self, homes: Homes, asks_moved: float = TASKS_ASK_MOVED) -> None:
        """Keep the true homes."""
        super().__init__(homes.prior, homes.configs, asks_moved)
        self._homes = homes

    @classmethod
    def make(cls, homes: Homes) -> Ceiling:
        """Keep the true homes."""
        return cls(homes)

    def read_moves(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the description's own row of T, (Q, F)."""
        codes = memory.objects["key"][queries.object]
        rows = self._homes.transition_rows(queries.home, codes).astype(float)
        return sum_relations(rows.reshape(len(rows), -1, NUM_RELATIONS))

    def read_type_moves(
        self, memory: MemoryBatch, home: np.ndarray, types: np.ndarray
    ) -> np.ndarray:
        """Return where objects of the type are placed at first, (n, F)."""
        moves = self._inventory.expected[home, np.maximum(types, 0)]
        total = moves.sum(axis=1, keepdims=True)
        return np.divide(moves, total, out=np.zeros_like(moves), where=total > 0)

    def read_weights(self, memory: MemoryBatch) -> np.ndarray:
        """Return what class noise has left of the prior, (H, O, F)."""
        weights = self._homes.get_place_weights()
        return sum_relations(weights.reshape(*weights.shape[:2], -1, NUM_RELATIONS))


class HomeFilter(PriorFilter):
    """The filter that knows the rules and learns the home's own version of the prior.

    Class noise and instance noise each rule out a place of the prior with `noise_zero_prob`. The
    filter follows how likely a place has survived both, and lets objects move in proportion to the
    prior times that:

    - A place where the description was seen has survived both; where another object of the type
      was seen, in the room at furniture of the label, it has survived class noise. It has from the
      start: a belief is computed anew, from where the log of looks starts, when an object or its
      type has been seen at a place for the first time.
    - A look that finds no object of the type, although m were expected if the place is possible,
      lowers the odds of all furniture of that label in the room by exp(-m).
    - A look that does not find the object, although it was believed to be there, lowers what
      instance noise has left, by Bayes' rule.

    Places are taken to be independent, and the scale of the noise is left out.

    Source: paper appendix A, "Sampling noise"; docs/design.md, rulings 5 and 6.
    """

    num_rows: ClassVar[int] = 5
    num_basis: ClassVar[int] = 3  # the prior, where the type was seen, where the object was

    def reset(self, memory: MemoryBatch) -> None:
        """Forget all looks, and read from the new memories what was ever seen where."""
        super().reset(memory)
        self._survives = 1 - np.array([config.noise_zero_prob for config in self._configs])
        self._group = _number_groups(memory)
        shape = (memory.num_homes * (len(self._prior.objects) + 1), memory.num_furniture)
        self._is_used = np.zeros(shape, dtype=bool)  # by type and group
        self._mark_used(memory, np.flatnonzero(memory.edges["num_true"] > 0))

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Note one look per home: where, and which objects were seen."""
        super().observe(memory, change)
        self._mark_used(memory, change.edges[change.is_seen])

    def compute_features(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return what is believed, but for `UNSEEN`, as columns of places, float32 (Q, F, 4)."""
        columns = self.follow(memory, queries)[:UNSEEN]
        return np.stack(list(columns), axis=2).astype(np.float32)

    def compute_basis(self, memory: MemoryBatch, subjects: Subjects) -> np.ndarray:
        """Return the prior, and where the type and the object were ever seen, (Q, 3, F)."""
        keys = self._number_types(subjects.home, subjects.type)
        group = self._group[subjects.home]
        is_used = self._is_used[keys[:, None], group]
        was_seen = np.zeros(is_used.shape, dtype=bool)
        known = np.flatnonzero(subjects.object >= 0)
        asked = Queries(subjects.home[known], subjects.object[known], subjects.moves[known])
        query, edge = memory.edges_of(asked)
        true = memory.edges["num_true"][edge] > 0
        was_seen[known[query[true]], memory.edges["furniture"][edge[true]]] = True
        return np.stack([subjects.moves, is_used, was_seen], axis=1)

    def start(self, subjects: Subjects, rules: Rules, basis: np.ndarray) -> np.ndarray:
        """Return the belief at the start of the log of an agent that knows what was seen where."""
        is_used, was_seen = basis[:, 1] > 0, basis[:, 2] > 0
        if self._base is not None:
            belief = super().start(subjects, rules, basis)
            belief[TYPE_POSSIBLE][is_used] = 1.0
            belief[OWN_POSSIBLE][was_seen] = 1.0
            return belief
        survives = self._survives[subjects.home][:, None]
        type_possible = np.where(is_used, 1.0, survives)
        own_possible = np.where(was_seen, 1.0, survives)
        is_unknown = subjects.type < 0  # no prior to doubt
        type_possible[is_unknown] = own_possible[is_unknown] = 1.0
        expected = rules.initial * type_possible * own_possible
        num_furniture = self._num_furniture[subjects.home]
        before = sum_rows(rules.initial, num_furniture)
        after = sum_rows(expected, num_furniture)
        scale = np.divide(before, after, out=np.ones_like(after), where=after > 0)
        unseen = self._inventory.expected[subjects.home, np.maximum(subjects.type, 0)]
        last, others = np.zeros(expected.shape), expected * scale[:, None]
        return np.stack([last, others, type_possible, own_possible, unseen])

    def _mark_used(self, memory: MemoryBatch, edges: np.ndarray) -> None:
        """Note that types were seen at furniture of a label in a room; rows of edges (n,)."""
        home = memory.edges["home"][edges]
        types = memory.objects["type"][memory.edges["object"][edges]]
        group = self._group[home, memory.edges["furniture"][edges]]
        self._is_used[self._number_types(home, types), group] = True


def _number_groups(memory: MemoryBatch) -> np.ndarray:
    """Number the pairs of room and furniture label by the first node of each, (H, F)."""
    label = memory.furniture_room * (memory.furniture_label.max() + 1) + memory.furniture_label
    group = np.empty(label.shape, dtype=np.int64)
    for home, labels in enumerate(label):
        _, first, number = np.unique(labels, return_index=True, return_inverse=True)
        group[home] = first[number]
    return group

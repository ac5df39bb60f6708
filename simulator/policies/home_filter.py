"""HomeFilter: a Bayes filter that starts from the prior and learns which places a home uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sgm.arrays.padded import sum_rows
from sgm.memory.change import Change
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from simulator.policies.filter_belief import FilterBelief, Rules, Subjects
from simulator.policies.filters import PriorFilter


@dataclass(slots=True)
class HomeBelief(FilterBelief):
    """What `HomeFilter` believes about each subject.

    Attributes:
        type_possible: probability that class noise has left the place to the object's type, (Q, F).
        own_possible: probability that instance noise has left the place to the description, given
            that it is left to the type, (Q, F).
        unseen: expected number of objects of the type that were never seen, (Q, F).
    """

    type_possible: np.ndarray
    own_possible: np.ndarray
    unseen: np.ndarray

    @property
    def noise(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What it believes about noise."""
        return self.type_possible, self.own_possible, self.unseen

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

    belief_type: ClassVar[type[FilterBelief]] = HomeBelief
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

    def follow(self, memory: MemoryBatch, queries: Queries) -> HomeBelief:
        """Return what is believed about the objects asked for, (Q, F)."""
        belief = super().follow(memory, queries)
        assert isinstance(belief, HomeBelief)
        return belief

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

    def start(self, subjects: Subjects, rules: Rules, basis: np.ndarray) -> HomeBelief:
        """Return the belief at the start of the log of an agent that knows what was seen where."""
        is_used, was_seen = basis[:, 1] > 0, basis[:, 2] > 0
        if self._base is None:
            return self._start_from_prior(subjects, rules, is_used, was_seen)
        belief = super().start(subjects, rules, basis)
        assert isinstance(belief, HomeBelief)
        belief.type_possible[is_used] = 1.0
        belief.own_possible[was_seen] = 1.0
        return belief

    def _start_from_prior(
        self, subjects: Subjects, rules: Rules, is_used: np.ndarray, was_seen: np.ndarray
    ) -> HomeBelief:
        """Return the belief at t = 0."""
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
        return HomeBelief(
            last=np.zeros(expected.shape),
            others=expected * scale[:, None],
            type_possible=type_possible,
            own_possible=own_possible,
            unseen=self._inventory.expected[subjects.home, np.maximum(subjects.type, 0)],
        )

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

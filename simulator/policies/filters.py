"""Bayes filters over an object's place: PriorFilter over the prior, Ceiling over the true T."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS, sum_relations
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from simulator.policies.filter_kernel import Rules, Subjects
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
        moves, initial = (np.where(is_unknown, alike, own) for own in (rules.moves, rules.initial))
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

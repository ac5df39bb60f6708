"""How many objects of each type a home is expected to have, and how often they move and leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.arrays.grouped import sum_rows
from sgm.prior.prior_graph import PriorGraph
from simulator.world.descriptions import make_descriptions
from simulator.world.rules import HomeRules


class Inventory:
    """What the rules of H homes say about their objects.

    Attributes:
        expected: expected objects per type and furniture node at t = 0, (H, O, F).
        sameness: probability that two objects of a type have the same description, (O,).
    """

    def __init__(
        self,
        prior: PriorGraph,
        configs: Sequence[HomeRules],
        weights: np.ndarray,
        num_furniture: np.ndarray,
        asks_moved: float,
    ) -> None:
        """Work out how many there are and how often they move, by the rules of each home, (H,).

        The initial objects were placed with `weights`, (H, O, F); `asks_moved` is the share of the
        queries that are about an object that has just moved.
        """
        self._asks_moved = asks_moved
        self._move_freq = np.array([object_type.move_freq for object_type in prior.objects])
        self._add_remove = np.array([object_type.add_remove_prob for object_type in prior.objects])
        self.sameness = make_descriptions(prior.objects).compute_sameness()
        self._is_dynamic = np.array([config.dynamic_nodes for config in configs])
        weights = (
            weights * np.array([object_type.sample_prob for object_type in prior.objects])[:, None]
        )
        total = weights.sum(axis=1, keepdims=True)
        share = np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)
        per_furniture = np.array([config.objects_per_furniture for config in configs])
        self.expected = share * per_furniture[:, None, None]
        self._count = sum_rows(self.expected, num_furniture)  # (H, O)
        move_share = np.array([config.move_share for config in configs])
        self._num_moves = move_share * self._count.sum(axis=1)
        self._total_weight = np.maximum((self._count * self._move_freq).sum(axis=1), 1e-12)
        self._kappa = self._solve_move_race()  # (H,)
        # The bounds on the object count keep removals and additions equal in the long run.
        leaving = (self._count * self._add_remove).sum(axis=1)
        coming = ((self._count > 0) * self._add_remove).sum(axis=1)
        both = np.minimum(leaving, coming)
        self._leaving_share = both / np.maximum(leaving, 1e-12)
        self._coming_share = both / np.maximum(coming, 1e-12)

    def compute_rates(
        self, home: np.ndarray, types: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the move, asked-move, remove and add rates of object types, (Q,) each.

        Source: docs/design.md, rulings 3, 8 and 9.
        """
        weight = self._move_freq[types]
        move = -np.expm1(-self._kappa[home] * weight)
        by_weight = (1 - self._asks_moved) * weight / self._total_weight[home]
        num_moves = np.maximum(self._num_moves[home], 1e-12)
        if_moved = move * (self._asks_moved / num_moves + by_weight)
        asked = if_moved / np.maximum(if_moved + (1 - move) * by_weight, 1e-12)
        rate = np.where(self._is_dynamic[home], self._add_remove[types], 0.0)
        remove = rate * self._leaving_share[home]
        add = rate * self._coming_share[home] * self.sameness[types]
        return move, asked, remove, add

    def _solve_move_race(self) -> np.ndarray:
        """Solve sum(1 - exp(-kappa w)) = moves per step for kappa, (H,).

        Drawing without replacement in proportion to w is a race of exponential clocks of rates w.
        """
        count, target = self._count, self._num_moves
        low, high = np.zeros(len(count)), np.full(len(count), 1e3)
        for _ in range(60):
            kappa = (low + high) / 2
            moves = (count * -np.expm1(-kappa[:, None] * self._move_freq)).sum(axis=1)
            low, high = np.where(moves < target, kappa, low), np.where(moves < target, high, kappa)
        return high

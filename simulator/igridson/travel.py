"""A search order that weighs the walk against the chance of finding the object."""

from __future__ import annotations

import numpy as np

from sgm.finder.search_plan import plan_tour
from sgm.policies.policy import ScoreKind, compute_probabilities
from simulator.igridson.walk import Walk
from simulator.tasks.search import SearchOrder

LOOK_COST = 5.0  # opening a fridge and scanning it takes as long as walking some cells
MOST_PLACES = 7  # of a tour; work grows as 2 ** MOST_PLACES


def compute_belief(
    scores: np.ndarray, kind: ScoreKind, is_open: np.ndarray, floor: float = 0.0
) -> np.ndarray:
    """Return where the object is, if at one of the open places, (n, F); sums to one.

    Args:
        scores: the policy's, (n, F).
        kind: the policy's `score_kind`.
        is_open: bool (n, F), some in each row.
        floor: share that is spread over all open places, so that none is impossible.
    """
    even = is_open / is_open.sum(axis=1, keepdims=True)
    known = compute_probabilities(np.where(is_open, scores, -np.inf), kind) * is_open
    # Where no open place has any mass, they are all alike.
    known = known / known.sum(axis=1, keepdims=True)
    return (1 - floor) * known + floor * even


class ByTravel(SearchOrder):
    """The next place of the tour that is expected to cost least until the object is found.

    A tour that visits places k_1, k_2, ... costs, in steps, the sum over its legs of
    (distance of the leg + look_cost) x P(not found before the leg). The tour over the
    `MOST_PLACES` most promising open places that minimises this is found exactly, by dynamic
    programming over sets of places visited; only its first place is looked at, then the policy
    is asked again. Legs between furniture nodes take the shortest way from beside one to the
    other.

    The promise of a place is its probability over its distance plus look cost, so that what is
    on the way stands for election, too.
    """

    _floor = 0.01  # a policy may be wrong about places that it rules out

    def __init__(
        self, walk: Walk, score_kind: ScoreKind = "weights", look_cost: float = LOOK_COST
    ) -> None:
        """Keep where agents stand, the kind of the policy's scores, and the price of a look, steps.

        Raises:
            ValueError: if the look cost is negative.
        """
        if look_cost < 0:
            raise ValueError(f"look_cost must be non-negative, got {look_cost}. Raise it.")
        self._walk = walk
        self._score_kind = score_kind
        self._look_cost = look_cost

    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose the first place of the best tour; `uniform` is not needed."""
        routes = self._walk.routes
        prob = compute_belief(scores, self._score_kind, is_open, self._floor)
        cost = routes.to_furniture[self._walk.cell[homes]] + self._look_cost  # (n, F)
        promise = np.where(is_open, prob / np.maximum(cost, 1e-9), -1.0)
        places = np.argsort(-promise, axis=1, kind="stable")[:, :MOST_PLACES]  # (n, K)
        rows = np.arange(len(homes))[:, None]
        legs = routes.between[places[:, :, None], places[:, None, :]] + self._look_cost
        tour = plan_tour(prob[rows, places], cost[rows, places], legs, is_open[rows, places])
        return places[np.arange(len(homes)), tour[:, 0]]

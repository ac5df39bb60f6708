"""Shortest paths in a grid home, who walks them, and a search order that weighs the walk."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import shortest_path

from sgm.finder.tour_optimiser import plan_tour
from sgm.policies.policy import ScoreKind, compute_probabilities
from simulator.igridson.layout import GridLayout, find_beside
from simulator.tasks.search import SearchOrder

# Directions as MiniGrid numbers them: right, down, left, up.
DIRECTIONS = ((1, 0), (0, 1), (-1, 0), (0, -1))
LOOK_COST = 5.0  # opening a fridge and scanning it takes as long as walking some cells
MOST_PLACES = 7  # of a tour; work grows as 2 ** MOST_PLACES


class Routes:
    """Path lengths and paths between the n free cells of a home; steps go to the four sides.

    To go to a furniture node is to go to the nearest free floor cell beside it.

    Attributes:
        cells: (column, row) of the free cells, row after row, (n, 2).
        index: number of each free cell, -1 elsewhere, (Y, X).
        distance: steps between free cells, -1 where there is no way, int (n, n).
        to_furniture: steps from each free cell to each furniture node, int (n, F).
        stand: free cell beside the furniture node that such a walk ends on, (n, F).
        between: steps from beside one furniture node to another, int (F, F): the shortest.
    """

    def __init__(self, layout: GridLayout) -> None:
        self.layout = layout
        rows, columns = np.nonzero(layout.is_free)
        self.cells = np.stack([columns, rows], axis=1)
        self.index = np.full(layout.is_free.shape, -1)
        self.index[rows, columns] = np.arange(len(rows))
        self.distance = self._compute_distances()
        beside = [
            self.index[find_beside(layout, furniture)] for furniture in range(len(layout.furniture))
        ]
        unreached = np.where(self.distance < 0, len(rows), self.distance)
        nearest = [unreached[:, cells].argmin(axis=1) for cells in beside]
        self.stand = np.stack(
            [cells[first] for cells, first in zip(beside, nearest, strict=True)], axis=1
        )
        self.to_furniture = np.take_along_axis(self.distance, self.stand, axis=1)
        self.between = np.stack([self.to_furniture[cells].min(axis=0) for cells in beside])

    def find_cell(self, position: tuple[int, int]) -> int:
        """Return the number of a free cell at (column, row).

        Raises:
            ValueError: if the cell is not free.
        """
        x, y = position
        columns, rows = self.layout.size
        if not (0 <= x < columns and 0 <= y < rows) or self.index[y, x] < 0:
            raise ValueError(
                f"position must be a free cell, got column {x}, row {y}. "
                "Choose floor without furniture."
            )
        return int(self.index[y, x])

    def find_path(self, cell: int, furniture: int, direction: int = 0) -> list[tuple[int, int]]:
        """Return the (column, row) cells of a shortest walk to a furniture node, both ends too.

        Of several shortest walks, the one that goes straight on as long as it can.

        Args:
            cell: number of the free cell to start from.
            furniture: furniture index.
            direction: where the agent faces at first, index into `DIRECTIONS`.
        """
        target = self.stand[cell, furniture]
        path = [(int(self.cells[cell, 0]), int(self.cells[cell, 1]))]
        while cell != target:
            x, y = path[-1]
            for turn in (direction, *(d for d in range(4) if d != direction)):
                step_x, step_y = DIRECTIONS[turn]
                following = self.index[y + step_y, x + step_x]  # walls close the border
                if following >= 0 and self.distance[following, target] == (
                    self.distance[cell, target] - 1
                ):
                    cell, direction = int(following), turn
                    path.append((x + step_x, y + step_y))
                    break
        return path

    def _compute_distances(self) -> np.ndarray:
        """Return steps between all free cells, (n, n)."""
        index = self.index
        ahead = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
        src = np.concatenate([a[(a >= 0) & (b >= 0)] for a, b in ahead])
        dst = np.concatenate([b[(a >= 0) & (b >= 0)] for a, b in ahead])
        count = len(self.cells)
        graph = coo_array((np.ones(len(src)), (src, dst)), shape=(count, count)).tocsr()
        distance = shortest_path(graph, method="D", directed=False, unweighted=True)
        return np.where(np.isfinite(distance), distance, -1).astype(np.int64)


class Walk:
    """The positions of H agents, one per home.

    Attributes:
        routes: the paths of the layout.
        cell: number of the free cell that each agent stands on, (H,).
        path_length: steps each has walked since `start_episode`, (H,).
    """

    def __init__(self, routes: Routes, num_homes: int) -> None:
        """Put every agent on the start cell."""
        self.routes = routes
        self.cell = np.full(num_homes, routes.find_cell(routes.layout.start))
        self.path_length = np.zeros(num_homes, dtype=np.int64)

    def start_episode(self) -> None:
        """Forget the steps; agents stay where they are."""
        self.path_length[:] = 0

    def go(self, homes: np.ndarray, furniture: np.ndarray) -> None:
        """Walk to the nearest free cell beside a furniture node; (n,), (n,)."""
        cells = self.cell[homes]
        self.path_length[homes] += self.routes.to_furniture[cells, furniture]
        self.cell[homes] = self.routes.stand[cells, furniture]


def compute_belief(
    scores: np.ndarray, score_kind: ScoreKind, is_open: np.ndarray, floor: float = 0.0
) -> np.ndarray:
    """Return where the object is, if at one of the open places, (n, F); sums to one.

    Args:
        scores: the policy's, (n, F).
        score_kind: the policy's `score_kind`.
        is_open: bool (n, F), some in each row.
        floor: share that is spread over all open places, so that none is impossible.
    """
    even = is_open / is_open.sum(axis=1, keepdims=True)
    known = compute_probabilities(np.where(is_open, scores, -np.inf), score_kind) * is_open
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

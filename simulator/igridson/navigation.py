"""Shortest paths in a grid home, from any cell to a free cell beside any furniture node."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import shortest_path

from simulator.igridson.layout import GridLayout
from simulator.igridson.layout_check import find_beside

# Directions as MiniGrid numbers them: right, down, left, up.
DIRECTIONS = ((1, 0), (0, 1), (-1, 0), (0, -1))


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

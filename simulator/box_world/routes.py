"""Ways through a home of boxes that keep a robot's width away from walls and furniture."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from simulator.box_world.floor import ROBOT_RADIUS, BoxFloor

CELL = 0.1  # metres
_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


class FloorRoutes:
    """Shortest ways to where furniture is looked at from, on a grid of cells of `CELL` metres.

    Attributes:
        is_free: cells on which the middle of the robot may be, bool (rows, columns).
    """

    def __init__(self, floor: BoxFloor) -> None:
        self._low = np.array(floor.low)
        columns, rows = np.ceil((np.array(floor.high) - self._low) / CELL).astype(int)
        y, x = np.indices((rows, columns)).reshape(2, -1)
        self._middles = middles = self._low + (np.stack([x, y], axis=1) + 0.5) * CELL
        is_free = np.ones(len(middles), dtype=bool)
        points = np.column_stack([middles, np.zeros(len(middles))])
        for box in (*floor.furniture, *floor.walls):
            points[:, 2] = box.center[2]  # whatever its height: nothing is driven over or under
            is_free &= ~box.contains(points, ROBOT_RADIUS)
        is_inside = np.zeros(len(middles), dtype=bool)
        first = min(room.low[0] for room in floor.rooms)
        last = max(room.high[0] for room in floor.rooms)
        for low, high in (
            *((room.low, room.high) for room in floor.rooms),
            ((first, -1.0), (last, 1.0)),
        ):
            is_inside |= ((middles >= low) & (middles <= high)).all(axis=1)
        self.is_free = (is_free & is_inside).reshape(rows, columns)
        self._stands = [
            self._find_cell(floor.find_stand(number)) for number in range(len(floor.furniture))
        ]
        self._graph = self._make_graph()
        self._searches: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._distance, self._towards = dijkstra(
            self._graph, directed=False, indices=self._stands, return_predecessors=True
        )

    def compute_distance(self, start: tuple[float, float], furniture: int) -> float:
        """Return metres from a position to where furniture is looked at from; inf for no way."""
        return float(self._distance[furniture, self._find_cell(start)])

    def measure_way(self, start: tuple[float, float], goal: tuple[float, float]) -> float:
        """Return metres from a position to another one; inf for no way."""
        return float(self._search(goal)[0][self._find_cell(start)])

    def _search(self, goal: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return distance of every cell to a position, and the next cell on the way there."""
        end = self._find_cell(goal)
        if end not in self._searches:
            self._searches[end] = dijkstra(
                self._graph, directed=False, indices=end, return_predecessors=True
            )
        return self._searches[end]

    def find_path(self, start: tuple[float, float], goal: int | tuple[float, float]) -> np.ndarray:
        """Return the corners of a way from `start` to furniture or to a position, (n, 2).

        Raises:
            ValueError: if there is none.
        """
        cell = self._find_cell(start)
        if isinstance(goal, int):
            end, towards = self._stands[goal], self._towards[goal]
        else:
            end, (_, towards) = self._find_cell(goal), self._search(goal)
        if cell != end and towards[cell] < 0:
            name = f"furniture {goal}" if isinstance(goal, int) else goal
            raise ValueError(
                f"position must be one that {name} can be reached from, got "
                f"{start[0]:.2f}, {start[1]:.2f}. Start on free floor."
            )
        cells = [cell]
        while cells[-1] != end:
            cells.append(int(towards[cells[-1]]))
        points = self._middles[cells]
        kept = [0]
        while kept[-1] < len(points) - 1:  # straight on as far as all is free
            corner = kept[-1]
            further = range(min(corner + 60, len(points) - 1), corner + 1, -1)
            is_free = (n for n in further if self.is_free_between(points[corner], points[n]))
            kept.append(next(is_free, corner + 1))
        return points[kept]

    def is_free_between(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Tell whether the robot can drive straight from one position to another, (2,) each."""
        num = max(math.ceil(np.linalg.norm(end - start) / (CELL / 2)), 1)
        points = start + (end - start) * np.linspace(0, 1, num + 1)[:, None]
        column, row = np.floor((points - self._low) / CELL).astype(int).T
        rows, columns = self.is_free.shape
        is_inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return bool(is_inside.all() and self.is_free[row, column].all())

    def _find_cell(self, position: tuple[float, float]) -> int:
        """Return the number of the free cell nearest to a position."""
        rows, columns = self.is_free.shape
        column, row = np.floor((np.array(position) - self._low) / CELL).astype(int)
        column, row = min(max(column, 0), columns - 1), min(max(row, 0), rows - 1)
        if self.is_free[row, column]:
            return int(row * columns + column)
        free_rows, free_columns = np.nonzero(self.is_free)
        nearest = np.argmin((free_rows - row) ** 2 + (free_columns - column) ** 2)
        return int(free_rows[nearest] * columns + free_columns[nearest])

    def _make_graph(self) -> coo_array:
        """Return the distances between free cells that touch."""
        rows, columns = self.is_free.shape
        number = np.arange(rows * columns).reshape(rows, columns)
        starts, ends, lengths = [], [], []
        for dx, dy in _NEIGHBOURS:
            row = slice(max(-dy, 0), rows - max(dy, 0))
            to_row = slice(max(dy, 0), rows - max(-dy, 0))
            column, to_column = slice(0, columns - dx), slice(dx, columns)
            is_open = self.is_free[row, column] & self.is_free[to_row, to_column]
            starts.append(number[row, column][is_open])
            ends.append(number[to_row, to_column][is_open])
            lengths.append(np.full(is_open.sum(), CELL * math.hypot(dx, dy)))
        pairs = (np.concatenate(starts), np.concatenate(ends))
        return coo_array((np.concatenate(lengths), pairs), shape=(rows * columns,) * 2).tocsr()

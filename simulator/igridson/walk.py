"""Where agents stand in many homes of one layout, and how far they have walked."""

from __future__ import annotations

import numpy as np

from simulator.igridson.navigation import Routes


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

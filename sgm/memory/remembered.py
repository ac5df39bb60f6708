"""What is remembered of many homes: their layouts, and tables of what was observed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.arrays.table import Table, make_table
from sgm.layout.layout import LayoutArrays
from sgm.schema import EDGES, FURNITURE, LONE_LOOKS, OBJECTS, POSITIONS


class Remembered:
    """What is remembered of H homes with up to R rooms and F furniture nodes each.

    Attributes:
        time: the current time step, the same for all homes.
        labels: text of every label index.
        room_label: (H, R). furniture_label, furniture_room: (H, F). Rows of homes with fewer rooms
            or less furniture end with -1.
        is_furniture: which columns are furniture of a home, bool (H, F).
        home_num_rooms, home_num_furniture: rooms and furniture nodes of each home, the first
            columns of its rows, (H,).
        num_homes, num_furniture: H, and F.
        furniture: table of furniture nodes, (H, F). What each column of this table and of the
            others holds is said where it is declared: `sgm.schema`.FURNITURE, `OBJECTS`, `EDGES`,
            `POSITIONS` and `LONE_LOOKS`.
        objects: table of object nodes, (O,).
        edges: table of object-furniture edges, (E,).
        positions: table of where objects were seen, in metres in the frame of the map, of one home;
            a row for each object, furniture node and relation that had a sighting with a position.
        lone_looks: table of looks for one object alone that did not find it.
        place_prior: the prior for these layouts.
        clock: where in the week step 0 of each home is, and how long its steps are
            (`Clock.row`), float64 (H, 2), nan for a home without; None if no home has one.
    """

    def __init__(
        self, labels: Sequence[str], layout: LayoutArrays, clock: np.ndarray | None
    ) -> None:
        """Begin with homes of which nothing but the layout is known."""
        self.time = 0
        self.clock = clock
        self.labels = list(labels)
        self._take_layout(layout)
        self.furniture = make_table(FURNITURE, (self.num_homes,), self.num_furniture)
        self.objects, self.edges = make_table(OBJECTS), make_table(EDGES)
        self.positions, self.lone_looks = make_table(POSITIONS), make_table(LONE_LOOKS)

    @property
    def tables(self) -> dict[str, Table]:
        """The tables of what was observed, by the names of their declarations (`TABLES`)."""
        return {
            "furniture": self.furniture,
            "objects": self.objects,
            "edges": self.edges,
            "positions": self.positions,
            "lone_looks": self.lone_looks,
        }

    @property
    def furniture_num_observed(self) -> np.ndarray:
        """Looks so far, (H, F)."""
        return self.furniture["num_observed"]

    @property
    def furniture_last_observed(self) -> np.ndarray:
        """Time step of the last look, (H, F)."""
        return self.furniture["last_observed"]

    def look_up_prior(self) -> None:
        """Look up the prior weight of every edge, again."""
        edges = self.edges
        edges["prior"][:] = self._get_prior(edges["object"], edges["furniture"], edges["relation"])

    def _take_layout(self, layout: LayoutArrays) -> None:
        self.room_label, self.place_prior = layout.room_label, layout.place_prior
        self.furniture_label, self.furniture_room = layout.furniture_label, layout.furniture_room
        self.num_homes, self.num_furniture = self.furniture_label.shape
        self.is_furniture = self.furniture_label >= 0
        self.home_num_rooms = np.count_nonzero(self.room_label >= 0, axis=1)
        self.home_num_furniture = np.count_nonzero(self.is_furniture, axis=1)

    def _get_prior(
        self, rows: np.ndarray, furniture: np.ndarray, relation: np.ndarray
    ) -> np.ndarray:
        """Return the prior weight of edges of object nodes; 0 for unknown types."""
        home, types = self.objects["home"][rows], self.objects["type"][rows]
        prior = self.place_prior.weights[home, np.maximum(types, 0), furniture, relation]
        return np.where(types >= 0, prior, 0)

"""Beliefs that are kept from one question to the next."""

from __future__ import annotations

import numpy as np

from sgm.arrays.table import Table
from simulator.policies.filter_looks import fit_keys


class KeptBeliefs:
    """One belief per object that was asked for, each as of its own time.

    Entries have `belief`, (K, F), `time` and `num_rounds`, up to which it knows what happened, and
    `basis`, what it was computed from, (B, F).
    """

    def __init__(self, num_rows: int, num_furniture: int, num_basis: int) -> None:
        """Start without beliefs; K, F and B."""
        entry = np.dtype(
            [("belief", np.float64, (num_rows, num_furniture)),
             ("time", np.int64), ("num_rounds", np.int64),
             ("basis", np.float64, (num_basis, num_furniture))]
        )  # fmt: skip
        self._entries = Table({"entry": entry})
        self._row_of_object = np.full(64, -1)

    def find(self, objects: np.ndarray) -> np.ndarray:
        """Return the row of each object (n,), -1 without a belief."""
        self._fit(objects)
        return self._row_of_object[objects]

    def take(self, rows: np.ndarray) -> np.ndarray:
        """Return a copy of entries (n,); zeros for row -1."""
        entries = self._entries["entry"]
        taken = np.zeros(len(rows), dtype=entries.dtype)
        taken[rows >= 0] = entries[rows[rows >= 0]]
        return taken

    def put(
        self, objects: np.ndarray, belief: np.ndarray, time: int, num_rounds: int, basis: np.ndarray
    ) -> None:
        """Keep what is believed about objects (n,); `belief` (K, n, F), `basis` (n, B, F)."""
        self._fit(objects)
        new = np.unique(objects[self._row_of_object[objects] < 0])
        self._row_of_object[new] = self._entries.append(len(new))
        rows = self._row_of_object[objects]
        entries = self._entries["entry"]
        entries["belief"][rows] = belief.swapaxes(0, 1)
        entries["time"][rows] = time
        entries["num_rounds"][rows] = num_rounds
        entries["basis"][rows] = basis

    def _fit(self, objects: np.ndarray) -> None:
        num_objects = int(objects.max(initial=-1)) + 1
        self._row_of_object = fit_keys(self._row_of_object, num_objects)

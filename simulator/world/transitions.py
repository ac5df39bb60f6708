"""T^i, the true dynamics of homes: where an object of each description goes, and how likely."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import concatenate_ranges
from sgm.arrays.table import Table
from simulator.world.transition_kernel import can_leave, list_entries, sample_moves, sample_places

# A weight and where it leads: eight bytes, so that a block is one or two lines of the cache.
_ENTRY = np.dtype([("place", np.int32), ("weight", np.float32)])


class Transitions:
    """Rows of weights over the places of a home, one per home and description, kept sparse.

    A row has some five positive weights among 64 places. They are its entries, in the order of
    the places, and fall into blocks: the entries of a block of neighbouring places, such as those
    of a room. An object moves within a block, a new one is put anywhere in the row.

    Attributes:
        num_rows: rows so far, N.
        num_places: of the largest home, P.

    Source: algorithm 1, section 4.1; docs/design.md, rulings 2 and 6.
    """

    def __init__(self, place_block: np.ndarray, places_per_furniture: int) -> None:
        """Start without rows.

        Args:
            place_block: block of every place of each home, ascending from 0, (H, P); what it says
                beyond the places of a home is never read.
            places_per_furniture: place p belongs to furniture p // places_per_furniture.
        """
        self.num_rows = 0
        self.num_places = place_block.shape[1]
        # Homes share a few layouts: read from the cache, unlike a row of blocks for each home.
        self._place_block, layout = np.unique(place_block, axis=0, return_inverse=True)
        self._layout_of_home = layout.reshape(-1)
        self._num_blocks = int(place_block.max()) + 1
        self._place_furniture = np.arange(self.num_places) // places_per_furniture
        self._entries = Table({"entry": _ENTRY})
        self._bounds = Table({"bound": np.int64})  # where each block starts, and an end
        self._bounds.append(1)

    def append(
        self, homes: np.ndarray, rows: np.ndarray, places: np.ndarray, weights: np.ndarray
    ) -> np.ndarray:
        """Add rows; return their numbers, (n,).

        Args:
            homes: the home of each row, (n,).
            rows: row of each weight, 0..n - 1, ascending, (k,).
            places: their places, ascending within a row, (k,).
            weights: non-negative, (k,).
        """
        entry = np.empty(len(rows), dtype=_ENTRY)
        ends = np.empty(len(homes) * self._num_blocks, dtype=np.int64)
        count = list_entries(
            rows, places, weights, self._layout_of_home[homes], self._place_block,
            self._num_blocks, entry, ends,
        )  # fmt: skip
        self._bounds.append(len(ends), bound=len(self._entries) + ends)
        self._entries.append(count, entry=entry[:count])
        first = self.num_rows
        self.num_rows += len(homes)
        return np.arange(first, self.num_rows)

    def read(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (n,) as float32 (n, P); zeros for row -1."""
        dense = np.zeros((len(rows), self.num_places), dtype=np.float32)
        known = np.flatnonzero(rows >= 0)
        start = self._bounds["bound"][rows[known] * self._num_blocks]
        count = self._bounds["bound"][(rows[known] + 1) * self._num_blocks] - start
        entry = self._entries["entry"][concatenate_ranges(start, count)]
        dense[np.repeat(known, count), entry["place"]] = entry["weight"]
        return dense

    def sample_moves(
        self, rows: np.ndarray, homes: np.ndarray, places: np.ndarray, uniform: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where objects move to: other furniture of the same block.

        Args:
            rows: (n,).
            homes: of the rows, (n,).
            places: where they are; `can_leave` must hold there, (n,).
            uniform: (n,).

        Returns:
            The new places, and whether they can move on from there, (n,) each.
        """
        return sample_moves(*self._tables, rows, self._layout_of_home[homes], places, uniform)

    def sample_places(
        self, rows: np.ndarray, homes: np.ndarray, uniform: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where n new objects are put, anywhere in their rows (n,); see `sample_moves`."""
        return sample_places(*self._tables, rows, self._layout_of_home[homes], uniform)

    def can_leave(self, rows: np.ndarray, homes: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return whether objects at places (n,) have other furniture to move to, bool (n,).

        The places may have weight zero themselves.
        """
        return can_leave(*self._tables, rows, self._layout_of_home[homes], places)

    @property
    def _tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, int, np.ndarray]:
        """Entries, bounds of blocks, blocks of each layout, their number, furniture of places."""
        return (
            self._entries["entry"], self._bounds["bound"], self._place_block, self._num_blocks,
            self._place_furniture,
        )  # fmt: skip

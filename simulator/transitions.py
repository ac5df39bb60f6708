"""T^i, the true dynamics of homes: where an object of each description goes, and how likely."""

from __future__ import annotations

import numpy as np

from simulator.grouped import concatenate_ranges
from simulator.memory.table import Table
from simulator.streams import sample_categorical


class Transitions:
    """Rows of weights over the P places of a home, one per home and description, kept sparse.

    A row has some five positive weights among 64 places. They are its entries, in the order of
    the places, and fall into blocks: the entries of a block of neighbouring places, such as those
    of a room. An object moves within a block, a new one is put anywhere in the row.

    Attributes:
        num_rows: rows so far, N.
        num_places: P.

    Source: algorithm 1, section 4.1; rulings 2 and 6.
    """

    def __init__(self, place_block: np.ndarray, places_per_furniture: int) -> None:
        """Start without rows.

        Args:
            place_block: block of every place, ascending from 0, (P,).
            places_per_furniture: place p belongs to furniture p // places_per_furniture.
        """
        self.num_rows = 0
        self.num_places = len(place_block)
        self._place_block = place_block
        self._num_blocks = int(place_block[-1]) + 1
        self._per_furniture = places_per_furniture
        # can_leave: whether the block has a positive weight at other furniture.
        self._entries = Table(
            {
                "place": np.int32, "furniture": np.int32, "weight": np.float32,
                "can_leave": np.bool_,
            }
        )  # fmt: skip
        self._blocks = Table({"start": np.int64, "count": np.int64})  # B per row

    def append(self, weights: np.ndarray) -> np.ndarray:
        """Add rows of weights (n, P); return their numbers, (n,)."""
        weights = weights.astype(np.float32)
        row, place = np.divmod(np.flatnonzero(weights), self.num_places)
        block = row * self._num_blocks + self._place_block[place]
        count = np.bincount(block, minlength=len(weights) * self._num_blocks)
        start = len(self._entries["place"]) + np.cumsum(count) - count
        furniture = self._number_furniture(row, place)
        at_furniture = np.bincount(furniture)  # entries
        self._blocks.append(len(count), start=start, count=count)
        self._entries.append(
            len(place), place=place, furniture=place // self._per_furniture,
            weight=weights[row, place], can_leave=count[block] > at_furniture[furniture],
        )  # fmt: skip
        first = self.num_rows
        self.num_rows += len(weights)
        return np.arange(first, self.num_rows)

    def read(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (n,) as float32 (n, P); zeros for row -1."""
        dense = np.zeros((len(rows), self.num_places), dtype=np.float32)
        known = np.flatnonzero(rows >= 0)
        start, count = self._find(rows[known])
        entry = concatenate_ranges(start, count)
        dense[np.repeat(known, count), self._entries["place"][entry]] = self._entries["weight"][
            entry
        ]
        return dense

    def sample_moves(
        self, rows: np.ndarray, places: np.ndarray, uniform: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where objects move to: other furniture of the same block.

        Args:
            rows: (n,).
            places: where they are; `can_leave` must hold there, (n,).
            uniform: (n,).

        Returns:
            The new places, and whether they can move on from there, (n,) each.
        """
        block = rows * self._num_blocks + self._place_block[places]
        return self._sample(
            self._blocks["start"][block],
            self._blocks["count"][block],
            uniform,
            places // self._per_furniture,
        )

    def sample_places(self, rows: np.ndarray, uniform: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Draw where new objects are put, anywhere in the row; returns as `sample_moves`."""
        return self._sample(*self._find(rows), uniform)

    def can_leave(self, rows: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return whether objects at places (n,) have other furniture to move to, bool (n,).

        The places may have weight zero themselves.
        """
        _, count = self._find(np.arange(self.num_rows))
        own = self._number_furniture(
            np.repeat(np.arange(self.num_rows), count), self._entries["place"]
        )  # ascending
        asked = self._number_furniture(rows, places)
        here = np.searchsorted(own, asked, "right") - np.searchsorted(own, asked)
        return self._blocks["count"][rows * self._num_blocks + self._place_block[places]] > here

    def _number_furniture(self, rows: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Number the furniture of all rows one after the other; (n,), (n,) -> (n,)."""
        return rows * (self.num_places // self._per_furniture) + places // self._per_furniture

    def _find(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first entry of rows (n,) and the number of their entries, (n,)."""
        first, last = rows * self._num_blocks, rows * self._num_blocks + self._num_blocks - 1
        start = self._blocks["start"][first]
        return start, self._blocks["start"][last] + self._blocks["count"][last] - start

    def _sample(
        self,
        start: np.ndarray,
        count: np.ndarray,
        uniform: np.ndarray,
        avoid: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw one of the entries start..start + count - 1, none at the furniture to avoid."""
        turn = np.arange(int(count.max(initial=1)))[:, None]
        index = turn + start  # (K, n)
        is_open = turn < count
        if avoid is not None:
            is_open &= self._entries["furniture"].take(index, mode="clip") != avoid
        weights = self._entries["weight"].take(index, mode="clip")
        weights *= is_open
        entry = start + sample_categorical(weights.T, uniform)
        return self._entries["place"][entry], self._entries["can_leave"][entry]

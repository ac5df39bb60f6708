"""A growing table of equally long columns."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import numpy as np


class Table:
    """Struct of arrays with amortised appends: rows are numbered in the order they are added.

    Columns are read as `table["name"]`: a writable view of the rows so far, which stays valid
    until the next `append`.
    """

    def __init__(self, columns: Mapping[str, type | np.dtype]) -> None:
        names: dict[np.dtype, list[str]] = {}
        for name, dtype in columns.items():
            names.setdefault(np.dtype(dtype), []).append(name)
        self._names = tuple(columns)
        self._num_rows = 0
        # Columns of one type lie in one array, so that a copy takes few calls.
        self._place_of = {
            name: (key, row) for key, own in names.items() for row, name in enumerate(own)
        }
        self._set_blocks({key: np.zeros((len(own), 16), key) for key, own in names.items()})

    def __len__(self) -> int:
        return self._num_rows

    def __getitem__(self, name: str) -> np.ndarray:
        return self._columns[name][: self._num_rows]

    @property
    def names(self) -> tuple[str, ...]:
        """Column names."""
        return self._names

    def copy(self) -> Table:
        """Return a table of the same rows that can be changed alone."""
        copied = copy.copy(self)
        copied._set_blocks({key: block.copy() for key, block in self._blocks.items()})
        return copied

    def append(self, num_rows: int, **values: np.ndarray | int) -> np.ndarray:
        """Add rows; columns that are not given are zero. Returns the new row numbers."""
        start, end = self._num_rows, self._num_rows + num_rows
        if end > self._capacity:
            added = ((0, 0), (0, max(end, 2 * self._capacity) - self._capacity))
            self._set_blocks({key: np.pad(block, added) for key, block in self._blocks.items()})
        for name, value in values.items():
            self._columns[name][start:end] = value
        self._num_rows = end
        return np.arange(start, end)

    def _set_blocks(self, blocks: dict[np.dtype, np.ndarray]) -> None:
        self._blocks = blocks
        self._columns = {name: blocks[key][row] for name, (key, row) in self._place_of.items()}
        self._capacity = next((block.shape[1] for block in blocks.values()), 0)

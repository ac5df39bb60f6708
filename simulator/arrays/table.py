"""A growing table of equally long columns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


class Table:
    """Struct of arrays with amortised appends: rows are numbered in the order they are added.

    Columns are read as `table["name"]`: a writable view of the rows so far, which stays valid
    until the next `append`.
    """

    def __init__(self, columns: Mapping[str, type | np.dtype]) -> None:
        self._columns = {name: np.zeros(16, dtype=dtype) for name, dtype in columns.items()}
        self._num_rows = 0

    def __len__(self) -> int:
        return self._num_rows

    def __getitem__(self, name: str) -> np.ndarray:
        return self._columns[name][: self._num_rows]

    @property
    def names(self) -> tuple[str, ...]:
        """Column names."""
        return tuple(self._columns)

    def copy(self) -> Table:
        """Return a table of the same rows that can be changed alone."""
        copied = Table({})
        copied._num_rows = self._num_rows
        copied._columns = {name: column.copy() for name, column in self._columns.items()}
        return copied

    def append(self, num_rows: int, **values: np.ndarray | int) -> np.ndarray:
        """Add rows; columns that are not given are zero. Returns the new row numbers."""
        start, end = self._num_rows, self._num_rows + num_rows
        for name, column in self._columns.items():
            if end > len(column):
                grown = np.zeros(max(end, 2 * len(column)), dtype=column.dtype)
                grown[:start] = column[:start]
                self._columns[name] = column = grown
            if name in values:
                column[start:end] = values[name]
        self._num_rows = end
        return np.arange(start, end)

"""Rows of named columns in a file that is mapped into memory."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sgm.messages import shorten


class MappedTable:
    """Rows of named columns in a file without a name, which is gone when the table is.

    Rows are written one after the other in a `with` statement, then read. What was read stays in
    the memory of the process, as pages of the file, until `release`; the system keeps those pages
    for as long as no other process needs the room.
    """

    def __init__(self, folder: Path) -> None:
        """Start without rows; the file lies in a folder, if it can be written to."""
        try:
            self._file = tempfile.TemporaryFile(dir=folder)
        except OSError:
            self._file = tempfile.TemporaryFile()
        self._rows = np.zeros(0, dtype=[])
        self._num_rows = 0
        self._mapping: mmap.mmap | None = None

    def __enter__(self) -> MappedTable:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()

    def __len__(self) -> int:
        return self._num_rows

    def append(self, columns: Mapping[str, np.ndarray]) -> None:
        """Add rows; columns (n, ...) have always the same names, types and further axes.

        Raises:
            OSError: if the disk is full.
        """
        if not self._rows.dtype.names:
            fields = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
            self._rows = np.zeros(0, dtype=np.dtype(fields, align=True))
        rows = np.zeros(len(next(iter(columns.values()))), dtype=self._rows.dtype)
        for name, column in columns.items():
            rows[name] = column
        try:
            self._file.write(rows.tobytes())
        except OSError as error:
            raise OSError(
                error.errno,
                "disk must take a copy of the collection for as long as it is read, got "
                f"{shorten(error.strerror)}. Free some space.",
            ) from error
        self._num_rows += len(rows)

    def finish(self) -> None:
        """Map the file, which may be closed afterwards; nothing can be appended from now on."""
        self._file.flush()
        if self._file.tell():  # an empty file cannot be mapped
            self._mapping = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
            self._rows = np.frombuffer(self._mapping, dtype=self._rows.dtype)

    @property
    def num_bytes(self) -> int:
        """Size of the file."""
        return self._rows.nbytes

    def take(self, rows: np.ndarray) -> np.ndarray:
        """Return rows by number, (n,) -> records (n,), with the columns as their fields."""
        return self._rows.take(rows)  # of records, thirty times as fast as indexing

    def release(self) -> None:
        """Take what was read out of the memory of the process."""
        if self._mapping is not None:
            self._mapping.madvise(mmap.MADV_DONTNEED)

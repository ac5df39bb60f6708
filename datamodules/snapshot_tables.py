"""The shards of a collection as tables in which any snapshot is found without a search."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from sgm.arrays.grouped import concatenate_ranges
from sgm.messages import shorten

VERSIONED = ("furniture", "object", "edge")
_PER_FRAME = 8  # snapshots, one bit of a byte each
# An array of a shard belongs to the first table whose name its own begins with, else to `home`.
_PER_FURNITURE = "snapshot_furniture"
_TABLES = (
    *(f"{kind}_version" for kind in VERSIONED),
    _PER_FURNITURE,
    "snapshot",
    "object",
    "edge",
    "room",
    "furniture",
)
_NO_CLOCK = np.full((1, 2), np.nan)
_MAX_MAPPED = 1 << 28  # bytes of homes that were read, before their pages are given back

Columns = dict[str, np.ndarray]


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


class SnapshotTables:
    """All arrays of all homes, one table for each kind of row, one home after the other.

    A row of `snapshot` is one snapshot, of `home` one home, of `snapshot_furniture` one furniture
    node as it was asked about in one snapshot, of `edge_version` one version of an edge, and so on;
    docs/data.md lists their columns. So homes may have any number of rooms and furniture nodes.
    Every frame of 8 successive snapshots of a home lists the versions that are valid somewhere in
    it, so that reading a snapshot looks through these, and not through all versions that its home
    ever had.

    The tables lie in temporary files, so that the memory of the process does not grow with the
    number of snapshots.

    Attributes:
        starts: first row of each home in each table, and the number of rows at the end, (H + 1,).
    """

    def __init__(self, shards: Iterable[Mapping[str, np.ndarray]], folder: Path) -> None:
        """Write the tables into a folder, if it can be written to; one home is held at a time.

        Raises:
            OSError: if the disk does not take them.
        """
        lists = [f"{kind}_list" for kind in VERSIONED]
        names = ("home", "frame", *_TABLES, *lists)
        starts: dict[str, list[int]] = {name: [] for name in names}
        with ExitStack() as stack:
            tables = {name: stack.enter_context(MappedTable(folder)) for name in names}
            for shard in shards:
                for name, table in tables.items():
                    starts[name].append(len(table))
                for name, columns in _make_rows(shard).items():
                    if name == "frame":  # where its lists begin, over all homes
                        columns = {key: len(tables[key]) + first for key, first in columns.items()}
                    tables[name].append(columns)
            for name, table in tables.items():
                starts[name].append(len(table))
            tables["frame"].append({name: np.array([len(tables[name])]) for name in lists})
            for table in tables.values():
                table.finish()
        self._tables = tables
        self.starts = {name: np.array(rows, dtype=np.int64) for name, rows in starts.items()}
        self._num_bytes = sum(table.num_bytes for table in self._tables.values())
        self._num_mapped = 0

    def __len__(self) -> int:
        """Return the number of snapshots."""
        return int(self.starts["snapshot"][-1])

    def take(self, name: str, rows: np.ndarray) -> np.ndarray:
        """Return rows of a table, (n,) -> records (n,)."""
        return self._tables[name].take(rows)

    def find_home(self, snapshots: np.ndarray) -> np.ndarray:
        """Return the home of each snapshot, (B,) -> (B,)."""
        return self.starts["snapshot"].searchsorted(snapshots, side="right") - 1

    def find_rows(self, name: str, home: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find what homes have in a table of `room`, `furniture`, `object` or `edge`.

        Returns:
            The rows of all homes, one home after the other, and how many each has, (n,).
        """
        starts = self.starts[name]
        counts = starts[home + 1] - starts[home]
        return concatenate_ranges(starts[home], counts), counts

    def find_furniture_rows(self, home: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Find the rows of `snapshot_furniture` of snapshots; arguments as for `take_versions`."""
        starts = self.starts["furniture"]
        counts = starts[home + 1] - starts[home]
        return concatenate_ranges(self.starts[_PER_FURNITURE][home] + number * counts, counts)

    def take_versions(
        self, kind: str, home: np.ndarray, number: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the versions that are valid in each snapshot.

        Args:
            kind: one of `VERSIONED`.
            home: of each snapshot, (B,).
            number: of each snapshot within its home, (B,).

        Returns:
            (n,) position in the batch and (n,) records of the versions, in the order of nodes or
            edges within each snapshot.
        """
        frame, place = np.divmod(number, _PER_FRAME)
        frame += self.starts["frame"][home]
        starts = self.take("frame", frame)[f"{kind}_list"]
        counts = self.take("frame", frame + 1)[f"{kind}_list"] - starts
        listed = self.take(f"{kind}_list", concatenate_ranges(starts, counts))
        bit = np.repeat(np.left_shift(1, place).astype(np.uint8), counts)
        valid = np.flatnonzero(listed["valid_in"] & bit)
        sample = np.repeat(np.arange(len(home)), counts).take(valid)
        rows = self.starts[f"{kind}_version"][home].take(sample) + listed["row"].take(valid)
        return sample, self.take(f"{kind}_version", rows)

    def release(self, num_snapshots: int) -> None:
        """Say that so many snapshots were read; gives memory back when it may have become much."""
        num_homes = len(self.starts["home"]) - 1
        self._num_mapped += num_snapshots * (self._num_bytes // num_homes)  # at most
        if min(self._num_mapped, self._num_bytes) > _MAX_MAPPED:
            self._num_mapped = 0
            for table in self._tables.values():
                table.release()


def _make_rows(shard: Mapping[str, np.ndarray]) -> dict[str, Columns]:
    """Share the arrays of a home out to the tables, and list the versions of its frames."""
    tables: dict[str, Columns] = {name: {} for name in ("home", *_TABLES, "frame")}
    for name, array in shard.items():
        owner = next((table for table in _TABLES if name.startswith(f"{table}_")), None)
        if owner is None:
            tables["home"][name] = array[np.newaxis]  # one row, whatever its shape
            continue
        if owner == _PER_FURNITURE:  # (S, F, ...) in a shard
            array = array.reshape(-1, *array.shape[2:])
        tables[owner][name.removeprefix(f"{owner}_")] = array
    tables["home"].setdefault("home_clock", _NO_CLOCK)
    num_frames = -(-len(tables["snapshot"]["time"]) // _PER_FRAME)
    for kind in VERSIONED:
        versions = tables[f"{kind}_version"]
        tables[f"{kind}_list"], tables["frame"][f"{kind}_list"] = _list_frames(
            versions.pop("valid_from"), versions.pop("valid_to"), num_frames
        )
    # The lists of a frame begin where the tables of the lists end: before they grow.
    return {"frame": tables.pop("frame"), **tables}


def _list_frames(
    valid_from: np.ndarray, valid_to: np.ndarray, num_frames: int
) -> tuple[Columns, np.ndarray]:
    """List the versions (V,), from one snapshot to before another, of each frame of a home.

    Returns:
        Columns of the list, (n,): `row`, the number of the version, ascending within each frame,
        and `valid_in`, whose bit i says whether it is valid in the i-th snapshot of the frame;
        and the first entry of each frame, (num_frames,).
    """
    first = valid_from // _PER_FRAME
    count = np.where(valid_to > valid_from, (valid_to - 1) // _PER_FRAME - first + 1, 0)
    frame = concatenate_ranges(first, count)
    order = np.argsort(frame, kind="stable")
    frame = frame[order]
    row = np.repeat(np.arange(len(count), dtype=np.int32), count)[order]
    begin = np.maximum(valid_from[row] - frame * _PER_FRAME, 0)
    end = np.minimum(valid_to[row] - frame * _PER_FRAME, _PER_FRAME)
    valid_in = (1 << end) - (1 << begin)  # bits begin, ..., end - 1
    columns = {"row": row, "valid_in": valid_in.astype(np.uint8)}
    return columns, np.searchsorted(frame, np.arange(num_frames))

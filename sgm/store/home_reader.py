"""Reads a memory file, also beside the process that writes it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

from sgm.store.connection import connect, translated
from sgm.store.event import StoredEvent, read_rows
from sgm.store.past import StoredSighting, list_near, list_runs
from sgm.store.snapshot import Snapshot, list_snapshots, read_snapshot


class HomeReader:
    """A memory file, of which nothing is changed; a context manager, which threads may share."""

    def __init__(self, path: str | Path) -> None:
        """Open a file.

        Raises:
            FileNotFoundError: if there is none; it is a `ValueError`, too.
            ValueError: if it is no memory file, or is damaged.
        """
        self.path = Path(os.path.realpath(path))
        self._named = Path(path)
        self._connection = connect(self._named, writes=False)
        self._version = -1
        self._lock = RLock()

    def __enter__(self) -> HomeReader:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def read(self, *, from_first: bool = False) -> tuple[Snapshot, list[StoredEvent]]:
        """Return a snapshot, the latest or the first, and all events after it.

        Raises:
            ValueError: if they are not as they were written.
        """
        with self._reading() as connection:
            snapshots = list_snapshots(connection)
            if not snapshots:
                raise ValueError("no snapshot")
            event, _, _ = snapshots[0 if from_first else -1]
            return read_snapshot(connection, event), read_rows(connection, event)

    def read_events(self, after: int) -> list[StoredEvent]:
        """Return the events after a number; raises ValueError if they are none."""
        with self._reading() as connection:
            return read_rows(connection, after)

    def has_changed(self) -> bool:
        """Tell whether another process or memory has written since the last call."""
        with translated(self._named):
            (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        has_changed = version != self._version
        self._version = version
        return has_changed

    def select(self, query: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        """Return the rows of a query."""
        with translated(self._named):
            return self._connection.execute(query, values).fetchall()

    def list_runs(self, keys: Sequence[str], *, is_single: bool) -> list[StoredSighting]:
        """See `sgm.store.past.list_runs`."""
        with self._lock, translated(self._named):
            return list_runs(self._connection, keys, is_single=is_single)

    def list_near(self, keys: Sequence[str], begin: int, end: int) -> list[StoredSighting]:
        """See `sgm.store.past.list_near`."""
        with self._lock, translated(self._named):
            return list_near(self._connection, keys, begin, end)

    def copy_to(self, connection: sqlite3.Connection) -> None:
        """Copy all tables as they are now into an empty database."""
        with translated(self._named):
            self._connection.backup(connection)

    def find_damage(self) -> list[str]:
        """Check every page and reference; return what is wrong, nothing if all is well.

        Raises:
            ValueError: if a snapshot or event is not as it was written.
        """
        with translated(self._named):
            found = self._connection.execute("PRAGMA integrity_check(20)").fetchall()
            faults = [str(line) for (line,) in found if line != "ok"]
            if not faults:
                broken = self._connection.execute("PRAGMA foreign_key_check").fetchmany(20)
                faults += [
                    f"row {row} of {table} names no {other}" for table, row, other, _ in broken
                ]
        if not faults:
            with self._reading() as connection:
                events = [event for event, _, _ in list_snapshots(connection)]
                for event in events:
                    read_snapshot(connection, event)
                read_rows(connection, min(events, default=0))
        return faults

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        """Read one state of the file, whatever is written meanwhile."""
        try:
            with self._lock, translated(self._named):
                self._connection.execute("BEGIN")
                try:
                    yield self._connection
                finally:
                    self._connection.execute("ROLLBACK")
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            if " must " in str(error):
                raise
            raise ValueError(
                f"memory file must be as it was written, got {error} in {self._named}. It was "
                "altered: use a copy, or start a new memory."
            ) from error

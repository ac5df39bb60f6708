"""Writes a memory file whole, or not at all."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import Any

from sgm.files import fcntl, find_target, open_partial, telling_write_errors
from sgm.store.connection import check_folder, connect, create, has_wal, translated
from sgm.store.event_rows import SightingRow, write_sightings
from sgm.store.owner import taken
from sgm.store.schema import make_tables
from sgm.store.snapshot import Snapshot, write_snapshot

_REPLACING = Lock()


def write_new(path: Path, fill: Callable[[sqlite3.Connection], object]) -> None:
    """Write a database under a temporary name, then rename it; an older file is replaced by it.

    Args:
        path: of a symbolic link, the file that it names is written.
        fill: writes all that is in it.

    Raises:
        ValueError: if a memory has the older file, in this process or another one.
        OSError: if the disk does not take it, or the path names a folder, pipe or device; what was
            there is as it was.
    """
    check_folder(Path(path))
    with telling_write_errors(path):
        target = find_target(path)
        partial, file = open_partial(target)
        try:
            with translated(partial):
                connection = create(partial)
                try:
                    connection.execute("PRAGMA journal_mode = MEMORY")
                    fill(connection)
                    connection.execute("PRAGMA journal_mode = DELETE")
                finally:
                    connection.close()
            os.fsync(file.fileno())
            with _REPLACING:  # by one thread, until what it has locked is free again
                if fcntl is not None:  # while it is locked
                    with file, _retired(target):
                        partial.replace(target)
                else:  # Windows renames no open file
                    file.close()
                    partial.replace(target)
        except BaseException:
            file.close()
            partial.unlink(missing_ok=True)
            raise


@contextmanager
def _retired(path: Path) -> Iterator[None]:
    """Have a file that is to be replaced; nothing of it stays beside the new one."""
    if not path.exists():
        _remove_beside(path)  # what a file that was removed has left
        yield
        return
    with taken(path) as owner:
        if owner.turn is not None:
            raise ValueError(
                f"memory file must be saved by the memory that is kept in it, got another one for "
                f"{path}. Save to another file."
            )
        try:
            if has_wal(path):  # of a process that was killed: the old one is whole until then
                with suppress(ValueError, OSError):
                    with translated(path), closing(connect(path, writes=True)) as connection:
                        connection.execute("PRAGMA journal_mode = DELETE")
                _remove_beside(path)
            yield
        finally:
            owner.release()


def _remove_beside(path: Path) -> None:
    for ending in ("-wal", "-shm"):
        path.with_name(path.name + ending).unlink(missing_ok=True)


def fill_new(
    connection: sqlite3.Connection,
    settings: Mapping[str, Any],
    snapshot: Snapshot,
    rooms: Sequence[tuple[Any, ...]],
    places: Sequence[tuple[Any, ...]],
    things: Sequence[tuple[str, str, str]],
    sightings: Sequence[SightingRow],
) -> None:
    """Write a new file of a memory.

    Args:
        connection: of an empty database.
        settings: columns of the table `home`.
        snapshot: what the memory holds.
        rooms: rows of that table.
        places: rows of that table.
        things: key, name and tracker of each.
        sightings: where things are.
    """
    connection.execute("BEGIN")
    make_tables(connection)
    columns = ("prior", "map", "clock_start", "step_seconds")
    home = tuple(settings[name] for name in columns)
    connection.execute("INSERT INTO home VALUES (?, ?, ?, ?)", home)
    connection.executemany("INSERT INTO rooms VALUES (?, ?, ?)", rooms)
    connection.executemany("INSERT INTO places VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", places)
    connection.executemany(
        "INSERT INTO things (key, name, tracker, is_known) VALUES (?, ?, ?, 1)", things
    )
    before = range(1 - len(sightings), 1)
    write_sightings(connection, before, snapshot.time, sightings, {})
    write_snapshot(connection, snapshot)
    connection.execute("COMMIT")

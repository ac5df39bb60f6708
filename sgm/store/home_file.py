"""The process that writes a memory file: every change is a transaction."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any
from weakref import finalize

from sgm.files import make_write_error
from sgm.store.connection import (
    check_folder,
    connect,
    name_wal,
    translate,
    translated,
)
from sgm.store.event import StoredEvent, insert_event, write_arguments
from sgm.store.event_rows import (
    CHANGES,
    SightingRow,
    configure_home,
    write_rows,
    write_sightings,
)
from sgm.store.new_file import write_new
from sgm.store.owner import Owner, taken
from sgm.store.past import StoredSighting, list_near, list_runs
from sgm.store.snapshot import Snapshot, delete_snapshot, list_snapshots, write_snapshot

KEPT_BYTES = 256 << 20  # of events; the oldest ones are removed
MOST_ANSWERS = 5000  # to the latest writes that may be sent again
_DAY_SECONDS = 86400.0
_MOST_PAGES = 10_000  # beside the file, 20 MB, until who writes moves them into it
_LONG_BYTES = 4 << 20  # beside the file, which `checkpoint` moves into it


class HomeFile:
    """Has a memory file, and writes to it until it is closed.

    Threads may share it: one transaction is written after the other. What is in a transaction has
    left the process when it ends; the disk has it after `sync`.

    Attributes:
        path: of the file, without links.
        number: of the last event.
        num_new: events since the latest snapshot.
        num_written: events by this object, also those of transactions that failed.
        kept_bytes: of arguments of events, from which on the oldest are removed.
        kept_days: after which the oldest are removed; None for no such bound.
    """

    def __init__(self, path: Path) -> None:
        """Open a file that there is.

        Raises:
            FileNotFoundError: if there is none; it is a `ValueError`, too.
            ValueError: if it is no memory file, is damaged, or another process writes it.
            OSError: if it lies on a network drive, or cannot be written.
        """
        self.path = Path(os.path.realpath(path))
        check_folder(self.path)
        self._lock, self._turn = RLock(), object()
        self._depth = self.num_written = 0
        self._things: dict[str, int] = {}  # numbers of things by their keys, as far as known
        self.kept_bytes = KEPT_BYTES
        self.kept_days: float | None = None
        self._connection = connect(self.path, writes=False)  # it is one of ours, and can be read
        self._connection.close()
        with taken(self.path) as owner:
            give_up, owner.give_up = owner.give_up, None
            self._owner, owner.turn = owner, self._turn
            try:
                if give_up is not None:  # of this process: the latest to open a file has it
                    give_up()
                self._open()
            except BaseException:
                _let_go(owner, self._turn, self._connection, self._lock)
                raise
            owner.give_up = partial(_give_up, self._connection, self._lock)
        # By what has no way back to this object: the collector may find that in a circle.
        about = self._owner, self._turn, self._connection, self._lock
        self._close = finalize(self, _let_go, *about)

    def _open(self) -> None:
        connection = self._connection = connect(self.path, writes=True)
        with translated(self.path):
            # The log beside the file is what a commit writes; it is forced to disk by `sync`.
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
            connection.execute(f"PRAGMA wal_autocheckpoint = {_MOST_PAGES}")
            self.number = self._find_last()
            snapshots = list_snapshots(connection)
            event, _, num_bytes = snapshots[-1] if snapshots else (0, 0, 0)
            self.num_new = self.number - event
            (new,) = connection.execute(
                "SELECT coalesce(sum(length(arguments)), 0) FROM events WHERE number > ?", (event,)
            ).fetchone()
            self._bytes = num_bytes + new

    @property
    def is_held(self) -> bool:
        """Whether this object writes the file: it was not closed, nor opened again."""
        return self._owner.turn is self._turn

    @property
    def is_writing(self) -> bool:
        """Whether a transaction is open."""
        return self._depth > 0

    @property
    def num_bytes(self) -> int:
        """Size of the file with what lies beside it."""
        sizes = []
        for path in (self.path, name_wal(self.path)):
            with suppress(OSError):
                sizes.append(path.stat().st_size)
        return sum(sizes)

    @property
    def is_in_place(self) -> bool:
        """Whether the path still leads to the file."""
        return self._owner.is_at(self.path)

    def is_lost(self) -> bool:
        """Tell whether the file was moved or removed.

        Raises:
            FileExistsError: if another file lies in its place.
        """
        if self.is_in_place:
            return False
        if os.path.lexists(self.path):
            raise FileExistsError(
                f"memory file must stay where it was opened, got another one at {self.path}. Move "
                "that one away."
            )
        return True

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Write all that is written meanwhile at once, or nothing.

        Raises:
            ValueError: if another memory or process has the file.
            OSError: if the disk does not take it; then nothing of it is written.
        """
        with self._lock:
            self._check_held()
            before = self.number, self._bytes, self.num_new
            self._depth += 1
            try:
                yield
                if self._depth == 1 and self._connection.in_transaction:
                    self._connection.execute("COMMIT")
            except BaseException as error:
                if self._depth == 1:
                    self._roll_back(*before)
                if isinstance(error, sqlite3.Error):
                    raise translate(error, self.path) from error
                raise
            finally:
                self._depth -= 1

    def append(
        self,
        kind: str,
        time: int,
        values: Mapping[str, Any],
        row_values: Mapping[str, Any],
        sightings: Sequence[SightingRow] = (),
    ) -> None:
        """Write an event, and what it changes in the tables that people read.

        Args:
            kind: what was called.
            time: time step after it.
            values: its arguments, as they are kept.
            row_values: the same with what tables need besides.
            sightings: where things are by it.
        """
        speaker = values.get("by")
        arguments = write_arguments({name: values[name] for name in values if name != "by"})
        with self.transaction():
            row = StoredEvent(
                number=self.number + 1, time=time, kind=kind, arguments=arguments, by=speaker
            )
            self._begin()
            try:
                insert_event(self._connection, row)
            except sqlite3.IntegrityError:
                raise ValueError(
                    f"memory file must be written by one process at a time, got events of another "
                    f"one in {self.path}. End it, and open the file again."
                ) from None
            write_rows(self._connection, row.number, time, kind, row_values)
            if CHANGES[kind] is not None:
                self._things.clear()
            if sightings:
                numbers = [row.number] * len(sightings)
                write_sightings(self._connection, numbers, time, sightings, self._things)
            self.number = row.number
            self.num_new += 1
            self.num_written += 1
            self._bytes += len(arguments)

    def configure(self, values: Mapping[str, Any]) -> None:
        """Say which prior, map and clock the home has from now on, in a transaction."""
        with self.transaction():
            self._begin()
            configure_home(self._connection, values)

    def add_snapshot(self, snapshot: Snapshot, step_seconds: float | None) -> None:
        """Write what the memory held after an event; older events may be removed.

        The first snapshot stays, from which all events go on that are kept, and one between the two
        that is the first once those before it are removed.
        """
        with self.transaction():
            self._begin()
            connection, snapshots = self._connection, list_snapshots(self._connection)
            new = snapshot.event, snapshot.time, self._bytes
            first, *others = snapshots or [new]
            if others and self._is_long(first, others[-1], step_seconds, 0.5) and len(others) < 2:
                pass  # the latest so far becomes the one between
            elif len(others) > 1 and self._is_long(others[0], new, step_seconds, 1.0):
                self._remove_until(others[0][0])
            elif others:
                delete_snapshot(connection, others[-1][0])
            write_snapshot(connection, snapshot, self._bytes)
            self.num_new = self.number - snapshot.event

    def _is_long(
        self,
        first: tuple[int, int, int],
        last: tuple[int, int, int],
        step_seconds: float | None,
        share: float,
    ) -> bool:
        """Tell whether events between two snapshots take half of the bytes, or a share of days."""
        days = (last[1] - first[1]) * (step_seconds or 0.0) / _DAY_SECONDS
        is_old = self.kept_days is not None and days >= share * self.kept_days
        return is_old or last[2] - first[2] >= self.kept_bytes / 2

    def _remove_until(self, event: int) -> None:
        """Remove events up to a snapshot, which is the first one then.

        The last sighting of each thing stays.
        """
        execute = self._connection.execute
        execute("DELETE FROM events WHERE number <= ?", (event,))
        execute(
            "DELETE FROM sighting_rows WHERE event <= ? AND EXISTS (SELECT 1 FROM sighting_rows AS "
            "later WHERE later.thing = sighting_rows.thing AND (later.time, later.event, later.nth)"
            " > (sighting_rows.time, sighting_rows.event, sighting_rows.nth))",
            (event,),
        )
        for number, _, _ in list_snapshots(self._connection):
            if number < event:
                delete_snapshot(self._connection, number)

    def list_runs(self, keys: Sequence[str], *, is_single: bool) -> list[StoredSighting]:
        """See `sgm.store.past.list_runs`."""
        with self._lock, translated(self.path):
            self._check_held()
            return list_runs(self._connection, keys, is_single=is_single)

    def list_near(self, keys: Sequence[str], begin: int, end: int) -> list[StoredSighting]:
        """See `sgm.store.past.list_near`."""
        with self._lock, translated(self.path):
            self._check_held()
            return list_near(self._connection, keys, begin, end)

    def find_answer(self, key: str) -> tuple[str, str] | None:
        """Return what a write was about, and its answer; None of a new key."""
        with self._lock, translated(self.path):
            self._check_held()
            found = self._connection.execute(
                "SELECT about, answer FROM answers WHERE key = ?", (key,)
            ).fetchone()
            return None if found is None else (str(found[0]), str(found[1]))

    def note_answer(self, key: str, about: str, answer: str) -> None:
        """Keep the answer of a write that may be sent again."""
        with self.transaction():
            self._begin()
            execute = self._connection.execute
            execute(
                "INSERT OR REPLACE INTO answers VALUES (?, ?, ?, ?)",
                (key, self.number, about, answer),
            )
            execute(
                "DELETE FROM answers WHERE rowid <= (SELECT max(rowid) FROM answers) - ?",
                (MOST_ANSWERS,),
            )

    def sync(self) -> None:
        """Have the disk take all transactions so far, to survive a loss of power.

        Raises:
            OSError: if it does not.
        """
        wal = name_wal(self.path)
        try:
            file = os.open(wal, os.O_RDWR)
        except FileNotFoundError:  # all is in the file itself
            return
        try:
            os.fsync(file)
        except OSError as error:
            raise make_write_error(error, wal, os.fstat(file).st_size) from error
        finally:
            os.close(file)

    def checkpoint(self) -> None:
        """Move what lies beside the file into it, once that is much; no write waits for it.

        Raises:
            OSError: if the disk does not take it; nothing is lost.
        """
        with suppress(OSError):
            if os.stat(name_wal(self.path)).st_size < _LONG_BYTES:
                return
        if self.is_held and self.is_in_place:
            with translated(self.path), closing(connect(self.path, writes=True)) as connection:
                connection.execute("PRAGMA wal_checkpoint(PASSIVE)")

    def copy(self, path: Path) -> None:
        """Write a copy of the file as it is now to another path, whole or not at all."""
        with translated(self.path):
            write_new(path, self._back_up)

    def _back_up(self, made: sqlite3.Connection) -> None:
        with self._lock:  # and not while the copy takes its place, which asks who has that file
            self._check_held()
            self._connection.backup(made)

    def close(self) -> None:
        """Let go of the file; what lies beside it is in it then, if no one reads it."""
        self._close()

    def _find_last(self) -> int:
        (last,) = self._connection.execute(
            "SELECT max(coalesce((SELECT max(number) FROM events), 0), "
            "coalesce((SELECT max(event) FROM snapshots), 0))"
        ).fetchone()
        return int(last)

    def _begin(self) -> None:
        if not self._connection.in_transaction:
            self._connection.execute("BEGIN IMMEDIATE")

    def _roll_back(self, number: int, num_bytes: int, num_new: int) -> None:
        self.number, self._bytes, self.num_new = number, num_bytes, num_new
        self._things.clear()
        with suppress(sqlite3.Error):
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")

    def _check_held(self) -> None:
        if self._owner.process != os.getpid():
            raise ValueError(
                f"memory file must be written by the process that opened it, got a fork of it for "
                f"{self.path}. Copy the memory there: a copy writes to no file."
            )
        if not self.is_held:
            raise ValueError(
                f"memory file must be written by one memory at a time, got one that is not the "
                f"latest to open {self.path}, or was closed. Go on with the latest, or save this "
                "one to another file."
            )


def _let_go(owner: Owner, turn: object, connection: sqlite3.Connection, lock: RLock) -> None:
    """Close a database, and with it the file of its owner, unless another one has that now."""
    if owner.process != os.getpid():  # a fork: it is not ours to close
        _LEFT_OPEN.append(connection)
        return
    if owner.turn is not turn:  # for good: a thread that holds the lock of a file need not wait
        return
    with owner.handing_on, lock:
        if owner.turn is turn:
            owner.turn = owner.give_up = None
            _give_up(connection, lock)
            owner.release()


def _give_up(connection: sqlite3.Connection, lock: RLock) -> None:
    """Close a database, and leave the owner to who has it next."""
    with lock:
        with suppress(sqlite3.Error):  # who reads it still has it as it is
            connection.execute("PRAGMA busy_timeout = 0")
            connection.execute("PRAGMA journal_mode = DELETE")
        connection.close()


_LEFT_OPEN: list[sqlite3.Connection] = []  # those of the process before a fork

"""Who may write a memory file or a log: one process at a time, and of a log one memory in it."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, TypeVar, cast
from weakref import WeakValueDictionary

from sgm.files import find_target, lock_file, open_file, take_lock

ENDING = ".lock"  # of the file beside a log by which it is locked; it stays and locks nothing

Own = TypeVar("Own", bound="_ProcessLock")


class _ProcessLock:
    """Has a file for this process, as long as a memory that wrote it lives."""

    def __init__(self) -> None:
        self._process = os.getpid()

    @classmethod
    def _find(cls: type[Own], key: str, *args: Any) -> Own:
        """Return the lock of a file: that of this process, if it has one, else a new one."""
        with _OPENING:
            known = _HELD.get((cls, key))
            if known is None or known._process != os.getpid():
                if known is not None:  # of the process before a fork
                    known._close()
                known = _HELD[cls, key] = cls(*args)
            return cast("Own", known)

    def _close(self) -> None:
        """Let go of the file, where it is this object that holds it."""


_OPENING = Lock()
_HELD: WeakValueDictionary[tuple[type, str], _ProcessLock] = WeakValueDictionary()


class SaveLock(_ProcessLock):
    """Has a memory file for this process, as long as a memory that saved it lives.

    The file itself is locked, so that nothing lies beside it. Memories of one process may save one
    file, one after the other; reading is free. Where the system has no locks, none is refused.
    """

    def __init__(self) -> None:
        super().__init__()
        self._writing = Lock()
        self._file: BinaryIO | None = None

    @classmethod
    @contextmanager
    def hold(cls, path: str | Path) -> Iterator[SaveLock]:
        """Have a file while it is saved, alone in this process, too; yields what keeps it.

        A process that writes a file locks the new one before it has its name, so that threads
        that save to one path wait for each other. Of another process, it raises ValueError.
        """
        known = cls._find(os.path.realpath(path))
        with known._writing:
            if not known._take(path):
                raise ValueError(
                    f"memory file must be saved by one process at a time, got another one at work "
                    f"for {path}. End it, or save to another file."
                )
            yield known
            known._take(path)  # what was written in the place of the one before

    def _take(self, path: str | Path) -> bool:
        """Lock what lies there now; tell whether no other process has it."""
        try:
            file = open_file(path)
        except OSError:  # nothing to lock; who saves says what is wrong
            return True
        if self._file is not None and os.path.samestat(
            os.fstat(self._file.fileno()), os.fstat(file.fileno())
        ):
            file.close()
            return True
        if lock_file(file) is False:
            file.close()
            return False
        self._close()
        self._file = file
        return True

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def __del__(self) -> None:
        """Unlock the file, before the next one opens it."""
        self._close()


class LogLock(_ProcessLock):
    """Has a log for this process, as long as a memory that opened it lives.

    Within the process the log is handed on: the memory that opened it last has the turn. So a
    memory that is saved and loaded again goes on in its log, and the one that it was before, which
    may still be around, no longer mixes its lines with those that follow.

    Attributes:
        turns: held while a line is written, or the turn goes to another memory.
        turn: of the memory that writes; None before the first one.
    """

    def __init__(self, path: Path) -> None:
        """Lock a log, on this machine and where the file system tells others of locks.

        Raises:
            ValueError: if another process has it.
            OSError: if there is no such folder, or it cannot be written to.
        """
        super().__init__()
        if not path.resolve().parent.is_dir():
            raise FileNotFoundError(
                f"folder of a log must exist, got none for {path}. Make it first."
            )
        try:
            beside = find_target(path)  # of a link: beside the file that it leads to
        except OSError as error:  # before a lock is made beside a device
            raise type(error)(
                error.errno,
                f"log must be a file, got {error.strerror}. Name it looks.jsonl",
                str(path),
            ) from error
        self._path = path
        self.turns = Lock()
        self.turn: object = None
        self._lock = take_lock(
            beside.with_name(beside.name + ENDING),
            f"log must be written by one process at a time, got another one at work for {path}."
            " End it, or choose another log.",
        )

    @classmethod
    def of(cls, path: Path) -> LogLock:
        """Return the lock of a log: that of this process, if it has one, else a new one."""
        try:
            key = str(path.resolve())
        except (OSError, RuntimeError) as error:  # a circle of links
            raise OSError(
                errno.ELOOP,
                f"log must be a file, got a symbolic link that leads to itself at {path}. Choose "
                "another log.",
            ) from error
        return cls._find(key, path)

    @contextmanager
    def take(self, turn: object, *, is_new: bool) -> Iterator[None]:
        """Write a line while no other is written; with `is_new` the turn becomes the writer's own.

        Raises:
            ValueError: if it is the turn of another memory, or the log is of another process.
        """
        if self._process != os.getpid():
            raise ValueError(
                f"log must be written by the process that opened it, got a fork of it for "
                f"{self._path}. Copy the memory there: a copy writes no log."
            )
        with self.turns:
            if turn is not self.turn and not is_new:
                raise ValueError(
                    f"log must be written by one memory at a time, got one that is not the latest "
                    f"to open {self._path}. Go on with that one, or give this one a log of its own."
                )
            yield
            self.turn = turn

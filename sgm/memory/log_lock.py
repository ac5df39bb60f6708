"""Who may write a log: one process at a time, and in it one memory."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary

from sgm.files import find_target

ENDING = ".lock"  # of the file beside a log by which it is locked; it stays and locks nothing


class LogLock:
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
        from filelock import FileLock, Timeout  # here, as only a memory with a log needs it

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
        self._process = os.getpid()
        self.turns = Lock()
        self.turn: object = None
        # Of the process, not of the thread that opened it.
        self._lock = FileLock(beside.with_name(beside.name + ENDING), thread_local=False)
        try:
            self._lock.acquire(timeout=0)
        except Timeout:
            raise ValueError(
                f"log must be written by one process at a time, got another one at work for {path}."
                " End it, or choose another log."
            ) from None

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
        with _OPENING:
            known = _HELD.get(key)
            if known is None or known._process != os.getpid():  # of the process before a fork
                known = _HELD[key] = cls(path)
            return known

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


_OPENING = Lock()
_HELD: WeakValueDictionary[str, LogLock] = WeakValueDictionary()

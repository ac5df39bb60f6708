"""Who may write a memory file or a log: one process at a time, and of a log one memory in it.

A file is locked by its device and inode, so that it has one owner whatever it is called: through
links, other spellings of a path, mounted folders, and after it was moved.
"""

from __future__ import annotations

import errno
import os
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, TypeVar, cast
from weakref import ReferenceType, WeakSet, WeakValueDictionary, finalize, ref

from sgm.files import find_target, lock_file, open_file, take_lock

ENDING = ".lock"  # of the file beside a log by which it is locked; it stays and locks nothing
# Files that were replaced under their name and have another one; each holds a descriptor.
_MOST_EARLIER = 8

AnyLock = TypeVar("AnyLock", bound="_ProcessLock")


class _Held:
    """A file that a process has locked, and those before it under its name that have another."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self._file: BinaryIO | None = None
        self._earlier: deque[BinaryIO] = deque()

    def take(self, path: Path) -> bool:
        """Lock what lies there now; tell whether no other process has it."""
        try:
            file = open_file(path)
        except OSError:  # nothing to lock; who writes says what is wrong
            return True
        if self._is(os.fstat(file.fileno())):
            file.close()
            return True
        is_locked = lock_file(file)
        if not is_locked:
            file.close()
            return is_locked is None  # no locks here: an open file could not be renamed in Windows
        self._let_go()
        self._file = file
        _LOCKED.add(self)
        return True

    def is_at(self, path: Path) -> bool:
        """Tell whether a path leads to the file; True where none is locked."""
        if self._file is None:
            return True
        try:
            return self._is(os.stat(path))
        except FileNotFoundError:
            return False

    def has(self, status: os.stat_result) -> bool:
        """Tell whether a file is locked here."""
        files = (*self._earlier, *([] if self._file is None else [self._file]))
        return any(os.path.samestat(os.fstat(file.fileno()), status) for file in files)

    def close(self) -> None:
        """Unlock everything."""
        for file in (*self._earlier, self._file):
            if file is not None:
                file.close()
        self._file = None
        self._earlier.clear()

    def _is(self, status: os.stat_result) -> bool:
        file = self._file
        return file is not None and os.path.samestat(os.fstat(file.fileno()), status)

    def _let_go(self) -> None:
        """Unlock the file that was replaced, unless it has another name still."""
        if self._file is None:
            return
        if os.fstat(self._file.fileno()).st_nlink == 0:
            self._file.close()
        else:
            self._earlier.append(self._file)
        self._file = None
        if len(self._earlier) > _MOST_EARLIER:
            self._earlier.popleft().close()


_LOCKED: WeakSet[_Held] = WeakSet()


def _is_held_here(path: Path, but: _Held) -> bool:
    """Tell whether this process has locked a file otherwise: under another name, or as a log."""
    try:
        status = os.stat(path)
    except OSError:
        return False
    held = (other for other in tuple(_LOCKED) if other is not but and other.process == os.getpid())
    return any(other.has(status) for other in held)


class _ProcessLock:
    """Has a file for this process, as long as a memory that wrote it lives."""

    def __init__(self) -> None:
        self._process = os.getpid()
        self._held = _Held()
        # Unlocks before the next one opens it; as `__del__` would, but where the collector finds a
        # circle the files are closed first of all.
        finalize(self, self._held.close).atexit = False

    @classmethod
    def _find(cls: type[AnyLock], key: str, *args: Any) -> AnyLock:
        """Return the lock of a file: that of this process, if it has one, else a new one."""
        with _OPENING:
            known = _HELD.get((cls, key))
            if known is None or known._process != os.getpid():
                if known is not None:  # of the process before a fork
                    known._close()
                known = _HELD[cls, key] = cls(*args)
            return cast("AnyLock", known)

    def _close(self) -> None:
        """Let go of the file, where it is this object that holds it."""
        self._held.close()


_OPENING = Lock()
_HELD: WeakValueDictionary[tuple[type, str], _ProcessLock] = WeakValueDictionary()


class SaveLock(_ProcessLock):
    """Has a memory file for this process, as long as a memory that saved it lives.

    The file itself is locked, so that nothing lies beside it. Memories of one process may save one
    file, one after the other, unless one is kept there (`keep`); reading is free. Where the system
    has no locks, no other process is refused.

    Attributes:
        path: of the file, without links.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self._writing = Lock()
        self._keeper: ReferenceType[Any] | None = None

    @classmethod
    @contextmanager
    def hold(cls, path: str | Path, memory: object) -> Iterator[SaveLock]:
        """Have a file while a memory is saved to it, alone in this process, too.

        It yields what keeps the lock. A process that writes a file locks the new one before it has
        its name, so that threads that save to one path wait for each other.

        Raises:
            ValueError: if another process has the file, or another memory is kept in it, or it is
                a log that is written.
            FileExistsError: if the memory is kept there, and another file lies in its place.
        """
        target = Path(os.path.realpath(path))
        known = cls._find(str(target), target)
        with known._writing:
            known._check_keeper(memory)
            known._take(path)
            yield known
            known._held.take(target)  # what was written in the place of the one before

    @classmethod
    def keep(cls, path: Path, memory: object) -> SaveLock:
        """Have a file, by its real path, in which no other memory is saved while this one lives.

        Raises:
            ValueError: as `hold`; a memory of this process that was kept there before gives it up.
        """
        known = cls._find(str(path), path)
        with known._writing:
            known._take(path)
            known._keeper = ref(memory)
        return known

    def _check_keeper(self, memory: object) -> None:
        keeper = None if self._keeper is None else self._keeper()
        if keeper is None:
            return
        if keeper is not memory:
            raise ValueError(
                f"memory file must be saved by the memory that is kept in it, got another one for "
                f"{self.path}. Save to another file."
            )
        if os.path.lexists(self.path) and not self._held.is_at(self.path):
            raise FileExistsError(
                errno.EEXIST,
                f"memory file must stay where it was opened, got another one at {self.path}. Move "
                "that one away.",
            )

    def _take(self, path: str | Path) -> None:
        if _is_held_here(self.path, self._held):
            raise ValueError(
                f"memory file must have one name and one use, got one that this process has as "
                f"another memory or as a log for {path}. Save to another file."
            )
        if not self._held.take(self.path):
            raise ValueError(
                f"memory file must be saved by one process at a time, got another one at work "
                f"for {path}. End it, or save to another file."
            )


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
        """Lock a log by its real path, here and where the file system tells others of locks.

        Raises:
            ValueError: if another process has it.
            OSError: if there is no such folder, or it cannot be written to.
        """
        super().__init__()
        if not path.parent.is_dir():
            raise FileNotFoundError(
                f"folder of a log must exist, got none for {path}. Make it first."
            )
        try:
            find_target(path)
        except OSError as error:  # before a lock is made beside a device
            raise OSError(
                error.errno,
                f"log must be a file, got {error.strerror} at {path}. Name it looks.jsonl.",
            ) from error
        self._path = path
        self.turns = Lock()
        self.turn: object = None
        refusal = (
            f"log must be written by one process at a time, got another one at work for {path}."
            " End it, or choose another log."
        )
        self._lock = take_lock(path.with_name(path.name + ENDING), refusal)
        self._take(refusal)

    @classmethod
    def of(cls, path: Path) -> LogLock:
        """Return the lock of a log: that of this process, if it has one, else a new one."""
        if os.path.islink(os.path.realpath(path)):
            raise OSError(
                errno.ELOOP,
                f"log must be a file, got a symbolic link that leads to itself at {path}. Choose "
                "another log.",
            )
        real = Path(os.path.realpath(path))
        return cls._find(str(real), real)

    @property
    def path(self) -> Path:
        """Of the log, without links."""
        return self._path

    def is_lost(self) -> bool:
        """Tell whether the log was moved or removed since the last line.

        Raises:
            FileExistsError: if another file lies in its place.
        """
        if self._held.is_at(self._path):
            return False
        if os.path.lexists(self._path):
            raise FileExistsError(
                errno.EEXIST,
                f"log must stay where it was opened, got another file at {self._path}. Move that "
                "one away.",
            )
        return True

    def take_file(self) -> None:
        """Lock the file that was begun."""
        self._held.take(self._path)

    def _take(self, refusal: str) -> None:
        """Lock the file, if there is one."""
        is_twice = _is_held_here(self._path, self._held)
        if is_twice or not self._held.take(self._path):
            self._lock.release()
            raise ValueError(
                f"log must have one name and one use, got one that this process has under another "
                f"name or as a memory file for {self._path}. Choose another log."
                if is_twice
                else refusal
            )

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

"""Who writes a memory file: one process at a time, and one memory in it.

The file itself is locked, by its device and inode, so that it has one owner whatever it is called:
through links, hard links, other spellings of a path, mounted folders, and after it was moved.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock, RLock
from typing import BinaryIO
from weakref import WeakValueDictionary

from sgm.files import lock_file, make_write_error

_Inode = tuple[int, int]
_TAKING = Lock()


class Owner:
    """Has a file for this process until it is let go of; it may be handed on within the process.

    The descriptor stays open for as long as the database is: to close any descriptor of a file ends
    the locks that SQLite has on it in the same process (sqlite.org/howtocorrupt.html, 2.2).

    Attributes:
        process: number of the process that has locked it.
        handing_on: held by who takes the file from another one of this process, or lets go of it.
        turn: of the one that writes; None of none.
        give_up: closes the database of that one.
    """

    def __init__(self, file: BinaryIO, inode: _Inode) -> None:
        """Hold an open file that was locked; `take` makes one."""
        self._file, self._inode = file, inode
        self.process = os.getpid()
        self.handing_on = RLock()
        self.turn: object = None
        self.give_up: Callable[[], None] | None = None

    @property
    def is_released(self) -> bool:
        """Whether it was let go of."""
        return self._file.closed

    @classmethod
    def take(cls, path: Path) -> Owner | None:
        """Lock a file, or return the owner that this process has; None if another process has it.

        Raises:
            OSError: if the file cannot be opened for writing.
        """
        with _TAKING:
            inode = get_inode(path)
            known = _OWNERS.get(inode)
            if known is not None and known.process == os.getpid():
                return known
            file = open(path, "r+b", buffering=0)
            if lock_file(file) is False:
                file.close()
                return None
            owner = _OWNERS[inode] = cls(file, inode)
            return owner

    def is_at(self, path: Path) -> bool:
        """Tell whether a path leads to the file."""
        try:
            return get_inode(path) == self._inode
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Let go of the file, after the database was closed."""
        if _OWNERS.get(self._inode) is self:
            del _OWNERS[self._inode]
        self._file.close()


_OWNERS: WeakValueDictionary[_Inode, Owner] = WeakValueDictionary()


def get_inode(path: Path) -> _Inode:
    """Return by what a file is known, whatever it is called; raises OSError if there is none."""
    status = os.stat(path)
    return status.st_dev, status.st_ino


@contextmanager
def taken(path: Path) -> Iterator[Owner]:
    """Have a file for this process; no other thread takes it or lets go of it meanwhile.

    Raises:
        ValueError: if another process has it.
        OSError: if it cannot be written.
    """
    while True:
        try:
            owner = Owner.take(path)
        except OSError as error:
            raise make_write_error(error, path, 1) from error
        if owner is None:
            raise ValueError(
                f"memory file must be written by one process at a time, got another one at work "
                f"for {path}. End it, or choose another file; to read it is free."
            )
        with owner.handing_on:
            if not owner.is_released and owner.is_at(path):
                yield owner
                return

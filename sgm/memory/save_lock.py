"""Who may save a memory file: one process at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import BinaryIO
from weakref import WeakValueDictionary

from sgm.files import lock_file, open_file


class SaveLock:
    """Has a memory file for this process, as long as a memory that saved it lives.

    The file itself is locked, so that nothing lies beside it. Memories of one process may save one
    file, one after the other; reading is free. Where the system has no locks, none is refused.
    """

    def __init__(self) -> None:
        self._process = os.getpid()
        self._writing = Lock()
        self._file: BinaryIO | None = None

    @classmethod
    @contextmanager
    def hold(cls, path: str | Path) -> Iterator[SaveLock]:
        """Have a file while it is saved, alone in this process, too; yields what keeps it.

        A process that writes a file locks the new one before it has its name, so that threads
        that save to one path wait for each other. Of another process, it raises ValueError.
        """
        key = os.path.realpath(path)
        with _OPENING:
            known = _HELD.get(key)
            if known is None or known._process != os.getpid():
                if known is not None:  # of the process before a fork
                    known._close()
                known = _HELD[key] = cls()
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


_OPENING = Lock()
_HELD: WeakValueDictionary[str, SaveLock] = WeakValueDictionary()

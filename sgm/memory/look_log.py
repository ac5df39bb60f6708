"""The writer of a memory's log: whole lines, one memory at a time."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from sgm.files import compute_checksum, make_write_error, read_file
from sgm.memory.clock import Clock
from sgm.memory.locks import LogLock
from sgm.messages import warn_caller

MOST_LOG_BYTES = 1 << 34
# What a line says only where there is any.
_LEFT_OUT = ("by", "box", "open_cost", "hidden", "viewpoint")


class LookLog:
    """Appends every change of a memory to a file.

    A line is written before its change is made, at once and whole or not at all, so that all but
    the last survive when the program dies. A log is of one home: memories that are started, saved
    and loaded one after the other may go on in the same file, each with a line that says how it was
    then. One memory at a time writes it (`LogLock`).

    Attributes:
        path: of the file, without links: the log stays where it is, whatever the process's folder
            is and a link leads to later.
        listener: gets every line when it was written; None for none. Not the line with which the
            log is begun anew, as that changes nothing.
    """

    def __init__(self, path: str | Path, check: Callable[[bytes, Path], object]) -> None:
        """Go on in a file, or begin one; a line that was cut off by a crash is taken out.

        Args:
            path: of the file.
            check: reads the lines of a file that there is, to see that it is a log.

        Raises:
            ValueError: if the file is no log, or another process writes it.
            OSError: if the folder does not exist, or the file cannot be read or written.
        """
        self._lock = LogLock.of(Path(path))
        self.path = self._lock.path
        self._turn = object()  # the one whose turn it is to write
        self.listener: Callable[[bytes], None] | None = None
        with self._lock.turns:
            if self.path.exists():
                whole = cut_torn_line(self.path)
                check(whole, self.path)
                if len(whole) < self.path.stat().st_size:
                    with self.path.open("r+b") as file:
                        file.truncate(len(whole))

    def start(self, line: bytes) -> None:
        """Write what a memory holds that begins, or goes on (`write_start`); now it has the log."""
        self._write(line, is_new=True)

    def go_on(self) -> None:
        """Have the log for a memory that is what its last line left."""
        with self._lock.take(self._turn, is_new=True):
            self._lock.take_file()

    def is_lost(self) -> bool:
        """Tell whether the file was moved or removed since the last line.

        Raises:
            FileExistsError: if another file lies in its place.
        """
        with self._lock.turns:
            return self._lock.is_lost()

    def rotate(self, old: Path, line: bytes) -> None:
        """Keep the log so far under another name, and begin anew with a line of `write_start`.

        Raises:
            ValueError: as `write`.
            OSError: if the new file cannot be written; then the log is as it was.
        """
        with self._lock.take(self._turn, is_new=False):
            self.path.replace(old)
            try:
                _append(self.path, line)
                with self.path.open("r+b") as begun:
                    _sync(begun, self.path)
            except BaseException:
                old.replace(self.path)
                raise
            self._lock.take_file()

    def sync(self) -> None:
        """Have the disk take all lines written so far; raises OSError if it does not."""
        with self._lock.turns:  # not while the log is begun anew: then there is none for a moment
            file = self.path.open("r+b")
        with file:
            _sync(file, self.path)

    def write(self, kind: str, time: int, clock: Clock | None, values: Mapping[str, Any]) -> None:
        """Append a line; with a clock it also says what time it was, for people.

        Values that lines need not have are left out where they are None or empty.

        Raises:
            ValueError: if it is no date of the clock, or another memory or process has the log.
            OSError: if the file cannot be written; it is left as it was.
        """
        said = {
            name: value
            for name, value in values.items()
            if name not in _LEFT_OUT or value not in (None, ())
        }
        self._write(write_line(kind, time, clock, said))

    def _write(self, line: bytes, *, is_new: bool = False) -> None:
        with self._lock.take(self._turn, is_new=is_new):
            _append(self.path, line)
            if is_new:
                self._lock.take_file()
            if self.listener is not None:
                self.listener(line)


def write_line(kind: str, time: int, clock: Clock | None, values: Mapping[str, Any]) -> bytes:
    """Return a line of a log, of a change and the time step after it."""
    date = {} if clock is None else {"at": clock.get_time(time).isoformat()}
    text = json.dumps(
        {"kind": kind, "time": time, **date, **values},
        ensure_ascii=False,
        separators=(",", ":"),
        # Boxes and viewpoints; or numbers of numpy, as ids and positions may be.
        default=lambda value: value.to_json() if hasattr(value, "to_json") else value.item(),
    )
    return f"{text}\n".encode()


def cut_torn_line(path: Path) -> bytes:
    """Return all whole lines, and warn if there is more."""
    content = read_file(path, MOST_LOG_BYTES)
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        warn_caller(
            f"the last line of {path} was cut off, perhaps by a crash: {len(content) - len(whole)} "
            "bytes are left out"
        )
    return whole


def _append(path: Path, content: bytes) -> None:
    """Append all of a content to a file, or, on a disk that is full, nothing."""
    left = content
    try:
        with path.open("ab", buffering=0) as file:
            size = file.seek(0, os.SEEK_END)
            try:
                while left:
                    left = left[file.write(left) :]
            except OSError:
                file.truncate(size)
                raise
    except OSError as error:
        raise make_write_error(error, path, len(content)) from error


def _sync(file: BinaryIO, path: Path) -> None:
    try:
        os.fsync(file.fileno())
    except OSError as error:
        raise make_write_error(error, path, os.fstat(file.fileno()).st_size) from error


def read_checksum(path: Path | None) -> str:
    """Return the checksum of the memory file that a log lies beside; "" if there is none."""
    try:
        return "" if path is None else compute_checksum(path)
    except OSError:
        return ""

"""The lines of a home's logs, and those that are written while one waits."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from sgm.files import make_read_error, open_file
from sgm.memory.log_reader import LogLine, read_lines, read_log
from sgm.replay.kept_home import list_ended_logs, name_log

_BEGINNING = b'{"kind":"start"'


class LogTail:
    """Reads logs line by line beside the process that writes them; a context manager, without lock.

    A log that is begun anew (a snapshot of the server) is read to its end before the new one.
    """

    def __init__(self, source: Path) -> None:
        """Read the log of a home.

        Args:
            source: a memory file, whose logs lie beside it, or a log.

        Raises:
            FileNotFoundError: if there is neither the file nor a log beside it.
            ValueError: if it cannot be read.
        """
        self.is_log = _is_log(source)
        self._path = source if self.is_log else name_log(Path(os.path.realpath(source)))
        self._file: BinaryIO | None = None
        self._rest, self._num_lines = b"", 0
        self._open()
        self._ended = [] if self.is_log else list_ended_logs(self._path)
        if self._file is not None:
            opened = os.fstat(self._file.fileno())
            # It may have ended since it was opened.
            self._ended = [log for log in self._ended if not os.path.samestat(opened, os.stat(log))]

    def read_new(self) -> list[LogLine]:
        """Return the lines that were written since the last call, at first all.

        Raises:
            ValueError: if one is no line of a log.
        """
        lines: list[LogLine] = []
        for log in self._ended:
            lines += read_log(log)
        self._ended = []
        if self._file is None:
            self._open()
        while self._file is not None:
            is_last = self._is_current()  # asked first: nothing is written to it when it is not
            lines += self._read_lines()
            if is_last:
                break
            self._close()
            self._open()
        return lines

    def __enter__(self) -> LogTail:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._close()

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
        self._file, self._rest, self._num_lines = None, b"", 0

    def _open(self) -> None:
        with suppress(FileNotFoundError):
            self._file = open_file(self._path)

    def _is_current(self) -> bool:
        assert self._file is not None
        try:
            found = os.stat(self._path)
        except FileNotFoundError:  # for a moment, or for good
            return True
        return os.path.samestat(os.fstat(self._file.fileno()), found)

    def _read_lines(self) -> list[LogLine]:
        assert self._file is not None
        content = self._rest + self._file.read()
        whole, end, self._rest = content.rpartition(b"\n")
        lines = read_lines(whole + end, self._path, self._num_lines + 1)
        self._num_lines += len(lines)
        return lines


def _is_log(source: Path) -> bool:
    """Tell whether a file is a log, and no memory."""
    try:
        with open_file(source) as file:
            return file.read(len(_BEGINNING)) == _BEGINNING
    except FileNotFoundError:
        if name_log(Path(os.path.realpath(source))).exists():
            return False
        raise FileNotFoundError(
            f"source must be a memory file or a log, got none at {source}. Check the path."
        ) from None
    except OSError as error:
        raise make_read_error(
            error, "source must be a file that can be read", f"for {source}. Check the path."
        ) from None

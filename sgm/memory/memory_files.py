"""What all calls of a memory share: its state, the lock before it, its log and its file.

Memory files are JSON with a version and a checksum, written whole or not at all.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Lock, RLock
from typing import Any

from sgm.files import (
    VERSION,
    check_version,
    make_read_error,
    parse_json,
    read_file,
    write_whole,
)
from sgm.memory.locks import SaveLock
from sgm.memory.log_writer import LookLog, read_checksum
from sgm.memory.look_log import read_lines
from sgm.memory.memory_content import MemoryContent, write_start
from sgm.memory.memory_state import MemoryState
from sgm.messages import shorten

FORMAT = "scene graph memory"
_END = b"}\n"


def save_content(path: str | Path, data: dict[str, Any]) -> None:
    """Write `MemoryContent.to_json` to a file; an older file is replaced only by a whole new one.

    Raises:
        OSError: if the folder does not exist or the disk does not take it.
    """
    path = Path(path)
    if not path.name:
        raise FileNotFoundError(f"memory file must have a name, got {path}. Name it home.sgm.")
    if not path.parent.is_dir():
        raise FileNotFoundError(
            f"folder of a memory file must exist, got {shorten(str(path.parent))} for {path}. Make "
            "it."
        )
    write_whole(path, write_file(data))


def write_file(data: Any) -> bytes:
    """Return a memory file: one line of JSON, which names the checksum of what it holds."""
    body = json.dumps(data, ensure_ascii=False, separators=(",", ":")).encode()
    return b"".join((_write_head(body), body, _END))


def _write_head(body: bytes | memoryview) -> bytes:
    """Return what a file says of its content, as it is written."""
    checksum = hashlib.sha256(body).hexdigest()
    head = {"format": FORMAT, "version": VERSION, "checksum": checksum}
    text = json.dumps(head, separators=(",", ":"))
    return f'{text[:-1]},"content":'.encode()


def load_content(path: str | Path) -> MemoryContent:
    """Read a memory from a file.

    Raises:
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it is none of ours, comes from another version of the
            package, or was altered or cut short.
    """
    try:
        written = read_file(path)
        file = parse_json(written, allow_nan=True)
    except OSError as error:
        rule = "memory file must be one that can be read"
        raise make_read_error(error, rule, f"for {path}. Check the path.") from error
    except ValueError as error:
        raise ValueError(
            f"memory file must be whole JSON, got {error} for {path}. It was altered, cut short, "
            "or is another file: use a copy, or start a new memory."
        ) from error
    if not isinstance(file, dict) or file.get("format") != FORMAT:
        raise ValueError(
            f"memory file must be one that SceneGraphMemory.save wrote, got another file at {path}."
            " Check the path."
        )
    check_version("memory file's", file.get("version"), path)
    try:
        body = memoryview(written)[_HEAD_BYTES : -len(_END)]
        if not written.startswith(_write_head(body)) or not written.endswith(_END):
            raise ValueError("another checksum than the one it states")
        return MemoryContent.from_json(file["content"])
    except ValueError as error:
        raise ValueError(
            f"memory file must be as it was saved, got {error} for {path}. It was altered: use a "
            "copy, or start a new memory."
        ) from error


_HEAD_BYTES = len(_write_head(b""))  # of any content


class MemoryFiles:
    """The part of `SceneGraphMemory` for its file and its log; `load` reads the file.

    One call at a time reads or changes the state. A change is written into the log before it is
    made.
    """

    _lock: RLock  # held by every call while it reads or changes the state
    _state: MemoryState
    _log: LookLog | None
    _save_lock: SaveLock | None  # of the file saved last, as long as the memory lives
    _kept_lock: SaveLock | None  # of the file in which a `KeptHome` keeps it
    _saving: Lock  # never waited for while the lock of the state is held

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` goes on; it holds no code.

        Args:
            path: such as "home.sgm".

        Raises:
            ValueError: if a memory of another process saved the file, and still lives.
            OSError: if the folder does not exist, or the disk does not take the file; an older
                file is left as it was.
        """
        self._save(path)

    def save_and_rotate(self, path: str | Path, old_log: str | Path) -> None:
        """Write the memory to a file, and begin its log anew from there; see `KeptHome.snapshot`.

        No call of another thread comes between the two: what the file holds and the lines of the
        new log are the memory. A process that is killed meanwhile leaves the old log whole, and
        perhaps the new one. Without a log, ValueError is raised, and errors as of `save`; when the
        file was not written, the new log alone is the memory.
        """
        if self._log is None:
            raise ValueError(
                f"memory must have a log to begin anew, got none for {path}. Give log= when it is "
                "made or loaded."
            )
        self._save(path, Path(old_log))

    def _save(self, path: str | Path, old_log: Path | None = None) -> None:
        # Of two saves the later one lasts; no other call waits for the disk.
        with self._saving, SaveLock.hold(path, self) as lock:
            before = "" if old_log is None else read_checksum(Path(path))
            with self._lock:
                content = self._state.get_content_to_save().copy()
                if self._log is not None and old_log is not None:
                    self._renew_lost_log(self._log)
                    self._log.rotate(old_log, write_start(content, file=before))
            save_content(path, content.to_json())
            self._save_lock = lock

    def sync_log(self) -> None:
        """Have the disk take all of the log, to survive a loss of power; raises OSError if not.

        What was changed before this call survives a kill of the process without it.
        """
        if self._log is not None:
            self._log.sync()

    def follow(self, listener: Callable[[bytes], None] | None) -> Callable[[], bytes]:
        """Have a function called with every line that the log gets from now on; None for none.

        It is called by who makes the change, just before that is made, and must not wait.

        Returns:
            What writes the line that stands for all up to now. It takes as long as `save`, and
            keeps no other call waiting.

        Raises:
            ValueError: if the memory writes no log.
        """
        with self._lock:
            if self._log is None:
                raise ValueError(
                    "memory must have a log to be followed, got none. Give log= when it is made or "
                    "loaded."
                )
            self._log.listener = listener
            return partial(write_start, self._state.get_content_to_save().copy())

    def _start_log(self, path: str | Path | None = None, goes_on: bool = False) -> None:
        """Write into a log that a new memory begins, or how the one is that goes on."""
        if path is not None:
            self._log = LookLog(path, read_lines)
        if self._log is not None:
            self._log.start(write_start(self._state.get_content_to_save(), is_new=not goes_on))

    def _go_on_in(self, log: Path) -> None:
        """Write into a log whose last line left the memory as it is."""
        self._log = LookLog(log, read_lines)
        self._log.go_on()

    def _keep(self, path: Path) -> None:
        """Have a file in which no other memory is saved, while this one lives."""
        self._kept_lock = SaveLock.keep(path, self)

    def _write(self, kind: str, time: int | None = None, **values: Any) -> None:
        """Append a change (`LogLine`) to the log, if there is one, before it is made."""
        if self._log is not None:
            self._renew_lost_log(self._log)
            time = self._state.time if time is None else time
            self._log.write(kind, time, self._state.clock, values)

    def _renew_lost_log(self, log: LookLog) -> None:
        """Begin the log anew if it was moved or removed.

        Raises:
            OSError: if another file lies in its place, or it cannot be written.
        """
        if not log.is_lost():
            return
        warnings.warn(f"the log was moved or removed: it is begun anew at {log.path}", stacklevel=4)
        file = read_checksum(None if self._kept_lock is None else self._kept_lock.path)
        log.start(write_start(self._state.get_content_to_save(), file=file))

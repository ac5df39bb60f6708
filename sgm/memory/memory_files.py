"""The part of a memory for its file and its log.

Memory files are JSON with a version and a checksum, written whole or not at all.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from sgm.checks import read_optional
from sgm.files import (
    VERSION,
    check_version,
    make_read_error,
    parse_json,
    read_file,
    write_whole,
)
from sgm.layout.layout import read_map_id
from sgm.memory.clock import Clock
from sgm.memory.locks import SaveLock
from sgm.memory.log_reader import read_lines
from sgm.memory.look_log import LookLog, read_checksum
from sgm.memory.memory_content import MemoryContent, write_start
from sgm.memory.memory_state import MemoryState
from sgm.memory.score_calibration import ScoreCalibration
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph, find_shipped

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


def begin_content(
    prior: PriorGraph | None,
    clock: Clock | None,
    score_calibration: ScoreCalibration | None,
    map_id: str,
) -> tuple[MemoryContent, PriorGraph]:
    """Return what a new memory begins with; arguments as of `SceneGraphMemory`."""
    _check_given(prior, clock, score_calibration)
    prior = prior if prior is not None else PriorGraph.household()
    content = MemoryContent.empty(prior.checksum, clock, read_map_id(map_id))
    return replace(content, score_calibration=score_calibration), prior


def load_given(
    path: str | Path,
    prior: PriorGraph | None,
    clock: Clock | None,
    score_calibration: ScoreCalibration | None,
    map_id: str,
) -> tuple[MemoryContent, PriorGraph]:
    """Read what a saved memory goes on with; arguments as of `SceneGraphMemory.load`."""
    content = load_content(path)
    prior = prior if prior is not None else find_shipped(content.prior)
    if prior is None:
        raise ValueError(
            f"prior must be the one of the memory, {content.prior[:12]}..., got no shipped one "
            f"of that checksum for {path}. Give its own prior, or PriorGraph.default() to go "
            "on with that one."
        )
    saved_map = content.layout.map_id
    if map_id and saved_map and saved_map != map_id:
        raise ValueError(
            f"memory must be of the map that the robot has, {shorten(map_id)}, got one of "
            f"{shorten(saved_map)} for {path}. Load it without map_id, and say with transform how "
            "the map was moved, or start a new memory."
        )
    content.layout.map_id = read_map_id(map_id) or saved_map
    _check_given(prior, clock, score_calibration)
    if clock is not None:
        clock.get_time(content.time)  # or it is refused
        content = replace(content, clock=clock)
    if score_calibration is not None:
        content = replace(content, score_calibration=score_calibration)
    return content, prior


def _check_given(prior: object, clock: object, score_calibration: object) -> None:
    """Raise TypeError for what is given to a memory and is something else."""
    for name, value, expected in (
        ("prior", prior, PriorGraph),
        ("clock", clock, Clock),
        ("score_calibration", score_calibration, ScoreCalibration),
    ):
        read_optional(name, value, expected, "Leave it out for the default.")


class MemoryFiles:
    """The file of a memory and its log; `SceneGraphMemory` says what each call does and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state
        self._saving = Lock()  # never waited for while the lock of the state is held
        # Of the file saved last and of that in which it is kept, as long as the memory lives.
        self._save_lock: SaveLock | None = None
        self._kept_lock: SaveLock | None = None

    def go_on_from(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content, as a log says that one went on."""
        with self._state.lock:
            self._state.begin(content.copy(), prior)
            self.start_log(goes_on=True)

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` goes on; it holds no code."""
        self._save(path)

    def save_and_rotate(self, path: str | Path, old_log: str | Path) -> None:
        """Write the memory to a file, and begin its log anew from there."""
        if self._state.log is None:
            raise ValueError(
                f"memory must have a log to begin anew, got none for {path}. Give log= when it is "
                "made or loaded."
            )
        self._save(path, Path(old_log))

    def _save(self, path: str | Path, old_log: Path | None = None) -> None:
        # Of two saves the later one lasts; no other call waits for the disk.
        with self._saving, SaveLock.hold(path, self) as lock:
            before = "" if old_log is None else read_checksum(Path(path))
            with self._state.lock:
                content = self._state.get_content_to_save().copy()
                if self._state.log is not None and old_log is not None:
                    self._state.renew_lost_log()
                    self._state.log.rotate(old_log, write_start(content, file=before))
            save_content(path, content.to_json())
            self._save_lock = lock

    def sync_log(self) -> None:
        """Have the disk take all of the log, to survive a loss of power; raises OSError if not."""
        if self._state.log is not None:
            self._state.log.sync()

    def follow(self, listener: Callable[[bytes], None] | None) -> Callable[[], bytes]:
        """Have a function called with every line that the log gets from now on; None for none."""
        with self._state.lock:
            if self._state.log is None:
                raise ValueError(
                    "memory must have a log to be followed, got none. Give log= when it is made or "
                    "loaded."
                )
            self._state.log.listener = listener
            return partial(write_start, self._state.get_content_to_save().copy())

    def start_log(self, path: str | Path | None = None, goes_on: bool = False) -> None:
        """Write into a log that a new memory begins, or how the one is that goes on."""
        if path is not None:
            self._state.log = LookLog(path, read_lines)
        if self._state.log is not None:
            content = self._state.get_content_to_save()
            self._state.log.start(write_start(content, is_new=not goes_on))

    def start_clock(self, clock: Clock) -> None:
        """Have a clock from now on; the log begins anew with it."""
        _check_given(None, clock, None)
        with self._state.lock:
            content = self._state.get_content_to_save()
            if content.clock is not None or clock is None:
                raise ValueError(
                    f"memory must have no clock to get one, got {shorten(content.clock)}. Replace "
                    "it with SceneGraphMemory.load(path, clock=...)."
                )
            clock.get_time(content.time)  # or it is refused
            content = replace(content, clock=clock)
            if self._state.log is not None:
                self._state.renew_lost_log()
                self._state.log.start(write_start(content, is_new=False))
            self._state.begin(content.copy(), self._state.prior)

    def go_on_in(self, log: Path) -> None:
        """Write into a log whose last line left the memory as it is."""
        self._state.log = LookLog(log, read_lines)
        self._state.log.go_on()

    def keep(self, path: Path) -> None:
        """Have a file in which no other memory is saved, while this one lives."""
        self._kept_lock = SaveLock.keep(path, self)
        self._state.kept_file = self._kept_lock.path

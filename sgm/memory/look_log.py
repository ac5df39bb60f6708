"""The log of a memory: one line of JSON for everything that was seen or changed, in order."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

from sgm.files import (
    VERSION,
    VersionError,
    check_version,
    make_read_error,
    make_write_error,
    parse_json,
    read_file,
)
from sgm.layout.box import Box
from sgm.layout.furniture import read_open_cost
from sgm.layout.layout import Layout, read_map_id
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.locks import LogLock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.sighting import parse_coverage
from sgm.memory.thing import LEAST_CONFIDENCE, STATEMENTS, ThingName
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import MAX_TIME

MOST_LOG_BYTES = 1 << 34
# What the values of a line must name, by kind.
_FIELDS: Mapping[str, tuple[str, ...]] = {
    "start": ("version", "prior", "clock", "rooms", "furniture", "map", "memory"),
    "room": ("room", "label"),
    "furniture": ("furniture", "label", "room", "description", "position"),
    "move": ("furniture", "room", "position"),
    "name": ("furniture", "label", "description"),
    "merge_furniture": ("furniture", "other"),
    "remove_room": ("room",),
    "remove_furniture": ("furniture",),
    "remove_object": ("description",),
    "look": ("furniture", "coverage", "seen"),
    "absent": ("furniture", "description", "coverage"),
    "query": ("description",),
    "moved": ("description", "furniture", "relation", "by", "confidence", "was_at"),
    "picked_up": ("description", "by", "confidence", "was_at"),
    "put_down": ("description", "furniture", "relation", "by", "confidence"),
    "step": ("num_steps",),
    "rename": ("description", "name", "by"),
    "merge": ("description", "other", "by"),
    "split": ("description", "by"),
    "split_off": ("description", "furniture", "name", "by"),
    "transform": ("angle", "shift", "map_id"),
}
# Id of the thing; who said it; checksum of the memory file that the log goes on from.
_OPTIONAL = ("id", "by", "file")
# What a line says only where there is any.
_LEFT_OUT = ("by", "box", "open_cost", "hidden", "viewpoint")


@dataclass(frozen=True, slots=True)
class LogLine:
    """One change of a memory.

    Attributes:
        kind: "start": a memory begins, or goes on after it was loaded, with this `layout` and this
            clock; `memory` is all that it holds then, a `MemoryContent`. "room", "furniture",
            "move", "name", "merge_furniture", "remove_room", "remove_furniture",
            "remove_object", "look", "absent", "query", "step", "moved", "picked_up", "put_down",
            "rename", "merge", "split", "split_off", "transform": what was called, with its
            arguments as values; a thing is named by its description and, where it has one, its id.
            `seen` of a look holds the arguments of each sighting: description, relation, confidence
            (a score where the memory calibrates it) and, of some, owner, id and embedding;
            `coverage` is one share or those of "in" and "onTop", `viewpoint` of a look is None or
            says from where it was.
        time: time step of the memory, after the change.
        values: JSON values by name.
    """

    kind: str
    time: int
    values: Mapping[str, Any]


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

    def __init__(self, path: str | Path) -> None:
        """Go on in a file, or begin one; a line that was cut off by a crash is taken out.

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
                whole = _cut_torn_line(self.path)
                _read_lines(whole, self.path)
                if len(whole) < self.path.stat().st_size:
                    with self.path.open("r+b") as file:
                        file.truncate(len(whole))

    def start(self, content: MemoryContent, *, is_new: bool, file: str = "") -> None:
        """Note what a memory holds that begins (`is_new`), or goes on; now it has the log.

        `file` is the checksum of the memory file that it lies beside, "" without one.
        """
        self._write(write_start(content, is_new=is_new, file=file), is_new=True)

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

    def rotate(self, old: Path, content: MemoryContent, file: str = "") -> None:
        """Keep the log so far under another name, and begin anew with what the memory holds.

        `file` is the checksum of the memory file that is about to be replaced, "" without one.

        Raises:
            ValueError: as `write`.
            OSError: if the new file cannot be written; then the log is as it was.
        """
        with self._lock.take(self._turn, is_new=False):
            self.path.replace(old)
            try:
                _append(self.path, write_start(content, is_new=False, file=file))
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
        """Append a `LogLine`; with a clock it also says what time it was, for people.

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
        self._write(_write_line(kind, time, clock, said))

    def _write(self, line: bytes, *, is_new: bool = False) -> None:
        with self._lock.take(self._turn, is_new=is_new):
            _append(self.path, line)
            if is_new:
                self._lock.take_file()
            if self.listener is not None:
                self.listener(line)


def read_log(path: str | Path) -> list[LogLine]:
    """Read a log; a last line that was cut off by a crash is left out, with a warning.

    Raises:
        TypeError: if it is no path.
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it cannot be read, or a line is none of a log; names it.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(
            f"log must be a path, got {shorten(path)}. Give the file that "
            'SceneGraphMemory(log="looks.jsonl") writes.'
        )
    path = Path(path)
    try:
        whole = _cut_torn_line(path)
    except OSError as error:
        where = f'for {path}. Make one with SceneGraphMemory(log="looks.jsonl").'
        raise make_read_error(error, "log must be a file that can be read", where) from error
    return _read_lines(whole, path)


def read_line(text: bytes, path: Path) -> LogLine:
    """Read a line; raises ValueError, TypeError, KeyError or OverflowError if it is none."""
    return _read_line(parse_json(text), path)


def write_start(content: MemoryContent, *, is_new: bool = False, file: str = "") -> bytes:
    """Return the line of a memory that begins (`is_new`) or goes on; see `LookLog.start`."""
    clock = content.clock
    values = {
        "version": VERSION,
        "prior": content.prior,
        "clock": None if clock is None else clock.to_json(),
        **content.layout.to_json(),
        "memory": None if is_new and content.score_calibration is None else content.to_json(),
        **({"file": file} if file else {}),
    }
    return _write_line("start", content.time, clock, values)


def _write_line(kind: str, time: int, clock: Clock | None, values: Mapping[str, Any]) -> bytes:
    at = {} if clock is None else {"at": clock.get_time(time).isoformat()}
    text = json.dumps(
        {"kind": kind, "time": time, **at, **values}, ensure_ascii=False, separators=(",", ":"),
        # Boxes and viewpoints; or numbers of numpy, as ids and positions may be.
        default=lambda value: value.to_json() if hasattr(value, "to_json") else value.item(),
    )  # fmt: skip
    return f"{text}\n".encode()


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


def _cut_torn_line(path: Path) -> bytes:
    """Return all whole lines, and warn if there is more."""
    content = read_file(path, MOST_LOG_BYTES)
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        warnings.warn(
            f"the last line of {path} was cut off, perhaps by a crash: {len(content) - len(whole)} "
            "bytes are left out",
            stacklevel=3,
        )
    return whole


def _read_lines(content: bytes, path: Path) -> list[LogLine]:
    lines = []
    for number, text in enumerate(content.splitlines(), 1):
        try:
            lines.append(read_line(text, path))
            if number == 1 and lines[0].kind != "start":
                raise ValueError(f"{shorten(lines[0].kind)} before any start")
        except VersionError:
            raise
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            raise ValueError(
                f"line {number} of a log must be one that SceneGraphMemory wrote, got "
                f"{type(error).__name__}: {error} in {path}. It was altered, or is another file: "
                "mend or remove the line."
            ) from None
    return lines


def _read_line(data: Any, path: Path) -> LogLine:
    kind, time = data["kind"], data["time"]
    if kind == "start":
        check_version("log", data.get("version"), path)
    if kind not in _FIELDS or not _is_time(time):
        raise ValueError(f"kind {shorten(kind)} at time {shorten(time)}")
    values = {name: data[name] for name in _FIELDS[kind]}
    values |= {name: data[name] for name in _OPTIONAL if name in data}
    if kind == "step" and not _is_time(values["num_steps"]):
        raise ValueError(f"{shorten(values['num_steps'])} steps")
    if kind == "start":
        clock = values["clock"]
        values["clock"] = None if clock is None else Clock.from_json(clock)
        values["memory"] = _read_memory(data, values["clock"])
        rooms, furniture = values.pop("rooms"), values.pop("furniture")
        values["layout"] = Layout.from_json(data, len(rooms), len(furniture))
    elif kind == "look":
        values["seen"] = [
            (description, str(relation), float(confidence), *about)
            for description, relation, confidence, *about in values["seen"]
        ]
        values["hidden"] = list(data.get("hidden", ()))
        for name in (*(row[0] for row in values["seen"]), *values["hidden"]):
            read_words("description", name)
        point = data.get("viewpoint")
        values["viewpoint"] = None if point is None else Viewpoint.from_json(point)
    elif kind in STATEMENTS:
        if not LEAST_CONFIDENCE <= float(values["confidence"]) <= 1:
            raise ValueError(f"confidence {shorten(values['confidence'])}")
    elif kind == "merge_furniture":
        if type(values["other"]) is not int:
            raise ValueError(f"other {shorten(values['other'])}")
    elif kind == "merge":
        values["other"] = ThingName.from_json(values["other"])
    elif kind == "transform":
        values["angle"], values["shift"] = float(values["angle"]), tuple(values["shift"])
    if kind != "start":
        for name in ("room", "furniture", "was_at"):  # numbers; a statement may name none
            number = values.get(name, 0)
            if type(number) is not int and not (number is None and kind in STATEMENTS):
                raise ValueError(f"{name} {shorten(number)}")
    if kind in ("furniture", "move"):
        position = values["position"]
        values["position"] = None if position is None else tuple(position)
        box = data.get("box")
        values["box"] = None if box is None else Box.from_json(box)
        values["open_cost"] = read_open_cost(data.get("open_cost"))
    if "coverage" in values:
        values["coverage"] = parse_coverage(values["coverage"])
    return LogLine(kind, time, values)


def _is_time(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_TIME


def _read_memory(data: Any, clock: Clock | None) -> MemoryContent:
    """Read what the memory of a "start" line holds, nothing where a new one begins."""
    if data["memory"] is None:
        content = MemoryContent.empty(str(data["prior"]), clock)
        return replace(content, layout=Layout(map_id=read_map_id(data["map"])))
    content = MemoryContent.from_json(data["memory"])
    if (content.time, content.clock) != (data["time"], clock):
        raise ValueError("a memory of another time or clock")
    return content

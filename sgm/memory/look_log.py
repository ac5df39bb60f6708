"""The log of a memory: one line of JSON for everything that was seen or changed, in order."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sgm.layout.home_layout import Furniture, HomeLayout
from sgm.memory.clock import Clock
from sgm.messages import shorten
from sgm.names.words import read_words

LOG_VERSION = 1
# What the values of a line must name, by kind.
_FIELDS: Mapping[str, tuple[str, ...]] = {
    "start": ("version", "clock", "rooms", "furniture"),
    "room": ("room", "label"),
    "furniture": ("furniture", "label", "room", "description", "position"),
    "move": ("furniture", "room", "position"),
    "remove_room": ("room",),
    "remove_furniture": ("furniture",),
    "remove_object": ("description",),
    "look": ("furniture", "coverage", "seen"),
    "absent": ("furniture", "description", "coverage"),
    "step": ("num_steps",),
}


@dataclass(frozen=True, slots=True)
class LogLine:
    """One change of a memory.

    Attributes:
        kind: "start": a memory begins, or goes on after it was loaded, with these rooms and
            furniture and this clock. "room", "furniture", "move", "remove_room",
            "remove_furniture", "remove_object", "look", "absent", "step": what was called, with
            its arguments as values. `seen` of a look holds description, relation and confidence of
            each sighting.
        time: time step of the memory, after the change.
        values: JSON values by name.
    """

    kind: str
    time: int
    values: Mapping[str, Any]


class LookLog:
    """Appends every change of a memory to a file.

    A line is written at once and whole, in one call, so that all but the last survive when the
    program dies. A log is of one home: memories that are started, saved and loaded one after the
    other may go on in the same file, each with a line that says how the home was then.

    Attributes:
        path: of the file.
    """

    def __init__(self, path: str | Path) -> None:
        """Go on in a file, or begin one; a line that was cut off by a crash is taken out.

        Args:
            path: such as "looks.jsonl".

        Raises:
            ValueError: if the file is no log.
            OSError: if the folder does not exist, or the file cannot be read or written.
        """
        self.path = Path(path)
        if self.path.exists():
            whole = _cut_torn_line(self.path)
            _read_lines(whole, self.path)
            if len(whole) < self.path.stat().st_size:
                with self.path.open("r+b") as file:
                    file.truncate(len(whole))

    def start(self, time: int, layout: HomeLayout, clock: Clock | None) -> None:
        """Note how the home is when a memory begins, or goes on.

        Raises:
            OSError: if the file cannot be written.
        """
        values = {
            "version": LOG_VERSION,
            "clock": None if clock is None else clock.to_json(),
            "rooms": [[number, label] for number, label in layout.rooms.items()],
            "furniture": [
                [number, row.label, row.room, row.description, row.position]
                for number, row in layout.furniture.items()
            ],
        }
        self.write("start", time, clock, values)

    def write(self, kind: str, time: int, clock: Clock | None, values: Mapping[str, Any]) -> None:
        """Append a line.

        Args:
            kind: as in `LogLine`.
            time: time step, after the change.
            clock: of the memory; the line then says what time it was, for people.
            values: as in `LogLine`.

        Raises:
            OSError: if the file cannot be written.
        """
        line: dict[str, Any] = {"kind": kind, "time": time}
        if clock is not None:
            line["at"] = clock.shift(time * clock.step_seconds).start.isoformat()
        text = json.dumps(
            {**line, **values}, ensure_ascii=False, separators=(",", ":"), default=_to_number
        )
        with self.path.open("ab", buffering=0) as file:
            file.write(f"{text}\n".encode())


def read_log(path: str | Path) -> list[LogLine]:
    """Read a log; a last line that was cut off by a crash is left out, with a warning.

    Raises:
        TypeError: if it is no path.
        ValueError: if there is no such file, or a line is none of a log; names it.
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
        raise ValueError(
            f"log must be a file that can be read, got {shorten(error.strerror)} for {path}. Make "
            "one "
            'with SceneGraphMemory(log="looks.jsonl").'
        ) from error
    return _read_lines(whole, path)


def make_furniture(row: list[Any]) -> Furniture:
    """Make the furniture of a row of a "start" line, without its number."""
    _, label, room, description, position = row
    return Furniture(label, room, description, None if position is None else tuple(position))


def _to_number(value: Any) -> Any:
    """Return what json knows of a number of numpy, as ids and positions may be."""
    return value.item()


def _cut_torn_line(path: Path) -> bytes:
    """Return all whole lines, and warn if there is more."""
    content = path.read_bytes()
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
            lines.append(_read_line(json.loads(text.decode("utf-8"))))
            if number == 1 and lines[0].kind != "start":
                raise ValueError(f"{shorten(lines[0].kind)} before any start")
        except (ValueError, TypeError, KeyError) as error:
            raise ValueError(
                f"line {number} of a log must be one that SceneGraphMemory wrote, got "
                f"{type(error).__name__}: {error} in {path}. It was altered, or is another file: "
                "mend or remove the line."
            ) from None
    return lines


def _read_line(data: Any) -> LogLine:
    kind, time = data["kind"], data["time"]
    if kind not in _FIELDS or not isinstance(time, int) or time < 0:
        raise ValueError(f"kind {shorten(kind)} at time {shorten(time)}")
    values = {name: data[name] for name in _FIELDS[kind]}
    if kind == "start":
        if values["version"] != LOG_VERSION:
            raise ValueError(f"version {shorten(values['version'])} instead of {LOG_VERSION}")
        clock = values["clock"]
        values["clock"] = None if clock is None else Clock.from_json(clock)
        values["furniture"] = {row[0]: make_furniture(row) for row in values["furniture"]}
        values["rooms"] = {int(number): str(label) for number, label in values["rooms"]}
    elif kind == "look":
        values["seen"] = [
            (read_words("description", words), str(relation), float(confidence))
            for words, relation, confidence in values["seen"]
        ]
    if "coverage" in values:
        values["coverage"] = float(values["coverage"])
    return LogLine(kind, time, values)

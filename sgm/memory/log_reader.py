"""The log of a memory, read: a line of JSON for everything that was seen or changed, in order."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sgm.files import (
    VersionError,
    check_version,
    make_read_error,
    parse_json,
)
from sgm.layout.box import Box
from sgm.layout.furniture import read_open_cost
from sgm.layout.layout import Layout, read_map_id
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.look import parse_coverage
from sgm.memory.look_log import cut_torn_line
from sgm.memory.memory_content import MemoryContent
from sgm.memory.thing import LEAST_CONFIDENCE, STATEMENTS, ThingName
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import MAX_TIME

# What the values of a line must name, by kind.
_FIELDS: Mapping[str, tuple[str, ...]] = {
    "start": ("version", "prior", "clock", "rooms", "furniture", "map", "memory"),
    "room": ("room", "label"),
    "rename_room": ("room", "label"),
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
# Id of the thing; who said it; checksum of the memory file that the log goes on from; what a clock
# said that was wrong.
_OPTIONAL = ("id", "by", "file", "wall")


@dataclass(frozen=True, slots=True)
class LogLine:
    """One change of a memory.

    Attributes:
        kind: "start": a memory begins, or goes on after it was loaded, with this `layout` and this
            clock; `memory` is all that it holds then, a `MemoryContent`. "room", "rename_room",
            "furniture", "move", "name", "merge_furniture", "remove_room", "remove_furniture",
            "remove_object", "look", "absent", "query", "step", "moved", "picked_up", "put_down",
            "rename", "merge", "split", "split_off", "transform": what was called, with its
            arguments as values; a thing is named by its description and, where it has one, its id.
            `seen` of a look holds the arguments of each sighting: description, relation, confidence
            (a score where the memory calibrates it) and, of some, owner, id and embedding;
            `coverage` is one share or those of `RELATIONS`, `viewpoint` of a look is None or
            says from where it was. A "step" of none has as `wall` what the clock of the machine
            said when it was wrong.
        time: time step of the memory, after the change.
        values: JSON values by name.
    """

    kind: str
    time: int
    values: Mapping[str, Any]


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
        whole = cut_torn_line(path)
    except OSError as error:
        where = f'for {path}. Make one with SceneGraphMemory(log="looks.jsonl").'
        raise make_read_error(error, "log must be a file that can be read", where) from error
    return read_lines(whole, path)


def read_line(text: bytes, path: Path) -> LogLine:
    """Read a line; raises ValueError, TypeError, KeyError or OverflowError if it is none."""
    return _read_line(parse_json(text), path)


def read_lines(content: bytes, path: Path, first: int = 1) -> list[LogLine]:
    """Read whole lines, of which `first` is the number of the first one in the file.

    Raises:
        ValueError: for what is none of a log, and names it.
    """
    lines = []
    for number, text in enumerate(content.splitlines(), first):
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
        for name in (*(arguments[0] for arguments in values["seen"]), *values["hidden"]):
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
        for name in ("room", "furniture", "was_at"):  # numbers; of the last there may be none
            number = values.get(name, 0)
            if type(number) is not int and (number is not None or name != "was_at"):
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

"""The events of a memory file: everything that was seen or changed, in order."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sgm.files import parse_json
from sgm.layout.box import Box
from sgm.layout.furniture import read_open_cost
from sgm.layout.layout import read_map_id
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.look import parse_coverage
from sgm.memory.memory_content import MemoryContent
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.thing import LEAST_CONFIDENCE, ThingName
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import MAX_TIME
from sgm.store.event import StoredEvent
from sgm.store.event_kinds import EVENT_KINDS, START, STATEMENTS
from sgm.store.home_reader import HomeReader

# How many arguments a sighting has: without and with an owner, an id, a position and a picture.
_SIGHTING_LENGTHS = (3, 4, 6, 8, 9)
# Id of the thing; who said it; what a clock said that was wrong; what a memory goes on with.
_OPTIONAL = ("id", "by", "wall", "clock", "prior", "map", "score_calibration")


@dataclass(frozen=True, slots=True)
class MemoryEvent:
    """One change of a memory.

    Attributes:
        kind: a row of `EVENT_KINDS`: what was called, with its arguments as values. The first one
            is a "start": a memory begins with this `layout` and this clock; `memory` is all that
            it holds then, a `MemoryContent`. A thing is named by its description and, where it has
            one, its id.
            `seen` of a look holds the arguments of each sighting: description, relation, confidence
            (a score where the memory calibrates it) and, of some, owner, id and embedding;
            `coverage` is one share or those of `RELATIONS`, `viewpoint` of a look is None or
            says from where it was, `is_named` that it is the memory that calls the things so, and
            no detector. A "step" of none has as `wall` what the clock of the machine
            said when it was wrong. "configure" goes on with what it names of another `clock`,
            `prior`, `map` and `score_calibration`.
        time: time step of the memory, after the change.
        values: by name.
        number: in the file; of a start, of the last event before it.
    """

    kind: str
    time: int
    values: Mapping[str, Any]
    number: int = 0


def start_event(content: MemoryContent, number: int = 0) -> MemoryEvent:
    """Return the event with which a memory of some content begins, after that of a number."""
    values = {"clock": content.clock, "layout": content.layout, "memory": content}
    return MemoryEvent(START, content.time, values, number)


def read_events(path: str | Path) -> list[MemoryEvent]:
    """Read all events of a memory file that are kept, the first a "start".

    Raises:
        TypeError: if it is no path.
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it is no memory file, or is damaged; names it.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(
            f"memory file must be a path, got {shorten(path)}. Give the file that "
            'SceneGraphMemory(path="home.sgm") writes.'
        )
    with HomeReader(path) as reader:
        return read_kept(reader, from_first=True)


def read_kept(reader: HomeReader, *, from_first: bool = False) -> list[MemoryEvent]:
    """Return a start with the latest snapshot, or the first, and all events after it.

    Raises:
        ValueError: if they are not as they were written.
    """
    snapshot, rows = reader.read(from_first=from_first)
    try:
        content = MemoryContent.from_snapshot(snapshot)
    except ValueError as error:
        raise ValueError(
            f"memory file must be as it was saved, got {error} for {reader.path}. It was altered: "
            "use a copy, or start a new memory."
        ) from error
    return [start_event(content, snapshot.event), *parse_rows(rows, reader.path)]


def parse_rows(rows: Iterable[StoredEvent], path: Path) -> list[MemoryEvent]:
    """Read the arguments of events.

    Raises:
        ValueError: for what is none, and names it.
    """
    events = []
    for row in rows:
        try:
            events.append(_parse_row(row))
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            raise ValueError(
                f"event {row.number} of a memory file must be one that SceneGraphMemory wrote, got "
                f"{type(error).__name__}: {error} in {path}. It was altered: use a copy."
            ) from None
    return events


def _parse_row(row: StoredEvent) -> MemoryEvent:
    kind, time, data = row.kind, row.time, parse_json(row.arguments)
    if kind not in EVENT_KINDS or kind == START or not _is_time(time):
        raise ValueError(f"kind {shorten(kind)} at time {shorten(time)}")
    arguments = EVENT_KINDS[kind].arguments
    if row.by is not None or "by" in arguments:
        data["by"] = row.by
    values = {name: data[name] for name in arguments}
    values |= {name: data[name] for name in _OPTIONAL if name in data}
    if kind == "step" and not _is_time(values["num_steps"]):
        raise ValueError(f"{shorten(values['num_steps'])} steps")
    if kind == "configure":
        _read_settings(values)
    elif kind == "look":
        values["seen"] = [
            (description, str(relation), float(confidence), *about)
            for description, relation, confidence, *about in values["seen"]
        ]
        if any(len(arguments) not in _SIGHTING_LENGTHS for arguments in values["seen"]):
            raise ValueError(f"sightings {shorten(values['seen'])}")
        values["hidden"] = list(data.get("hidden", ()))
        values["is_named"] = data.get("is_named", False) is True
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
    return MemoryEvent(kind, time, values, row.number)


def _is_time(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_TIME


def _read_settings(values: dict[str, Any]) -> None:
    """Read what a memory goes on with from then on."""
    if values.get("clock") is not None:
        values["clock"] = Clock.from_json(values["clock"])
    if values.get("score_calibration") is not None:
        values["score_calibration"] = ScoreCalibration.from_json(values["score_calibration"])
    if "map" in values:
        values["map"] = read_map_id(values["map"])
    if not isinstance(values.get("prior", ""), str):
        raise ValueError(f"prior {shorten(values['prior'])}")

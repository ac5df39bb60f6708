"""The rooms and furniture of a recorded home: `layout.json`."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from sgm.checks import is_number
from sgm.files import (
    VERSION,
    VersionError,
    check_version,
    make_read_error,
    parse_json,
    read_file,
)
from sgm.layout.box import Box
from sgm.layout.furniture import Furniture, Room, read_open_cost, read_position
from sgm.layout.layout import Layout
from sgm.messages import shorten
from sgm.names.words import read_words

LAYOUT_FILE = "layout.json"
_FIELDS = ("version", "rooms", "furniture", "start", "end_s")
_ROOM_FIELDS = ("name", "label")
_FURNITURE_FIELDS = ("name", "room", "label", "description", "position", "box", "open_cost")
_BOX_FIELDS = ("center", "size", "yaw", "interior", "outline")


def get_label(name: str) -> str:
    """Return what something is from its name: "shelf 2" and "shelf_2" are a "shelf"."""
    return re.sub(r"[\s_]*\d+$", "", read_words("name", name)) or read_words("name", name)


def number_names(labels: Sequence[str]) -> list[str]:
    """Return a name for each label: "shelf 1", "shelf 2" where there are several."""
    total, count = Counter(labels), Counter[str]()
    names = []
    for label in labels:
        count[label] += 1
        names.append(label if total[label] == 1 else f"{label} {count[label]}")
    return names


def read_start(start: Any) -> datetime:
    """Read a local date and time, such as 2024-05-06T07:30.

    Raises:
        ValueError: if it is none, or has a time zone.
    """
    try:
        time = datetime.fromisoformat(start)
    except (TypeError, ValueError):
        raise ValueError(
            f"start must be a date and time, got {shorten(start)}. Write it like 2024-05-06T07:30."
        ) from None
    if time.tzinfo is not None:
        raise ValueError(
            f"start must be local time, got the time zone of {shorten(start)}. Leave the zone out."
        )
    return time


def read_part(noun: str, path: Path) -> bytes:
    """Read a file of a trace; ValueError if it cannot be read."""
    try:
        return read_file(path)
    except OSError as error:
        where = f"for {path}. A trace is a folder with layout.json and events.csv."
        raise make_read_error(error, f"{noun} must be a file that can be read", where) from error


def load_layout(path: Path) -> tuple[Layout, datetime | None, float | None]:
    """Read a `layout.json`: rooms and furniture, and `start` and `until_s` of the trace.

    Raises:
        ValueError: if it is missing or broken; names the file and the entry.
    """
    content = read_part("layout", path)
    try:
        data = parse_json(content)
    except ValueError as error:
        raise ValueError(f"layout must be JSON in UTF-8, got {error} in {path}. Mend it.") from None
    try:
        return _read_layout(data, path)
    except VersionError:
        raise
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def make_layout_json(layout: Layout, start: datetime | None, until_s: float | None) -> str:
    """Write the text of a `layout.json`, one row per line; arguments as in `Trace`."""
    rooms = [
        room.name
        if room.label == get_label(room.name)
        else {"name": room.name, "label": room.label}
        for room in layout.rooms.values()
    ]
    furniture = []
    for piece in layout.furniture.values():
        entry: dict[str, Any] = {"name": piece.name, "room": layout.rooms[piece.room].name}
        if piece.label != get_label(piece.name):
            entry["label"] = piece.label
        if piece.description != piece.label:
            entry["description"] = piece.description
        if piece.position is not None:
            entry["position"] = list(piece.position)
        if piece.box is not None:
            entry["box"] = {name: getattr(piece.box, name) for name in _BOX_FIELDS}
            if piece.box.outline is None:
                del entry["box"]["outline"]
        if piece.open_cost is not None:
            entry["open_cost"] = piece.open_cost
        furniture.append(entry)
    parts = [
        f'"version": {VERSION}',
        f'"rooms": {json.dumps(rooms, ensure_ascii=False)}',
        '"furniture": [\n  '
        + ",\n  ".join(json.dumps(entry, ensure_ascii=False) for entry in furniture)
        + "\n ]",
    ]
    if start is not None:
        parts.append(f'"start": "{start.isoformat()}"')
    if until_s is not None:
        parts.append(f'"end_s": {json.dumps(until_s)}')
    return "{\n " + ",\n ".join(parts) + "\n}\n"


def _read_layout(data: Any, path: Path) -> tuple[Layout, datetime | None, float | None]:
    if not isinstance(data, Mapping):
        raise ValueError(
            f"layout must be a JSON object, got {shorten(data, 60)}. See docs/traces.md."
        )
    check_version("layout", data.get("version", VERSION), path)
    _check_fields("layout", data, _FIELDS)
    rooms = tuple(_read_rooms(data.get("rooms")))
    start, end_s = data.get("start"), data.get("end_s")
    if end_s is not None and not (is_number(end_s) and 0 < end_s < math.inf):
        raise ValueError(f"end_s must be a number of seconds > 0, got {shorten(end_s)}. Mend it.")
    return (
        Layout.of(rooms, _read_furniture(data.get("furniture"), rooms)),
        None if start is None else read_start(start),
        None if end_s is None else float(end_s),
    )


def _read_rooms(rows: Any) -> Iterator[Room]:
    seen: set[str] = set()
    for index, given in enumerate(_check_list("rooms", rows)):
        where = f"rooms[{index}]"
        entry = (
            {"name": given} if isinstance(given, str) else _check_row(where, given, _ROOM_FIELDS)
        )
        name = _read_name(f"{where}.name", entry.get("name"), seen)
        yield Room(_read_label(f"{where}.label", entry.get("label"), name), name)


def _read_furniture(rows: Any, rooms: tuple[Room, ...]) -> Iterator[Furniture]:
    numbers = {read_words("room", room.name): index for index, room in enumerate(rooms)}
    seen: set[str] = set()
    for index, given in enumerate(_check_list("furniture", rows)):
        where = f"furniture[{index}]"
        entry = _check_row(where, given, _FURNITURE_FIELDS)
        name = _read_name(f"{where}.name", entry.get("name"), seen)
        room = numbers.get(read_words(f"{where}.room", entry.get("room", "")))
        if room is None:
            raise ValueError(
                f"{where}.room must be one of {', '.join(r.name for r in rooms)}, got "
                f"{shorten(entry['room'])}. Add the room, or mend its name."
            )
        label = _read_label(f"{where}.label", entry.get("label"), name)
        description = entry.get("description")
        if description is not None:
            read_words(f"{where}.description", description)
        position = read_position(entry.get("position"))
        box = _read_box(f"{where}.box", entry.get("box"))
        cost = read_open_cost(entry.get("open_cost"))
        yield Furniture(label, room, description or label, name, position, box, cost)


def _read_box(where: str, given: Any) -> Box | None:
    if given is None:
        return None
    entry = _check_row(where, given, _BOX_FIELDS)
    for name in ("center", "size"):
        if name not in entry:
            raise ValueError(
                f"{where} must have the field {name}, got {shorten(given, 60)}. Add it."
            )
    return Box(**entry)


def _check_list(noun: str, rows: Any) -> list[Any]:
    if not isinstance(rows, list) or not rows:
        raise ValueError(f"{noun} must be a list with entries, got {shorten(rows, 60)}. Add some.")
    return rows


def _check_row(where: str, given: Any, fields: tuple[str, ...]) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise ValueError(
            f"{where} must be a JSON object, got {shorten(given, 60)}. Name its fields."
        )
    _check_fields(where, given, fields)
    return given


def _check_fields(where: str, given: Mapping[str, Any], fields: tuple[str, ...]) -> None:
    for name in given:
        if name not in fields:
            raise ValueError(
                f"{where} must have the fields {', '.join(fields)}, got {shorten(name)}. Remove it."
            )


def _read_name(noun: str, name: Any, seen: set[str]) -> str:
    words = read_words(noun, name)
    if words in seen:
        raise ValueError(
            f"{noun} must be unique, got {shorten(name)} again. Number them: {name} 2."
        )
    seen.add(words)
    return str(name).strip()


def _read_label(noun: str, label: Any, name: str) -> str:
    return get_label(name) if label is None else read_words(noun, label)

"""What happened in a recorded home: `events.csv`."""

from __future__ import annotations

import csv
import io
import math
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from sgm.layout.layout import Layout
from sgm.memory.sighting import Point, read_point, read_relation
from sgm.messages import shorten, shorten_values
from sgm.names.words import read_words
from sgm.schema import RELATIONS
from simulator.trace.layout import LAYOUT_FILE, get_label, read_part, read_start

EVENTS_FILE = "events.csv"
_POSITION = ("x", "y", "z")
COLUMNS = ("time_s", "object", "furniture", "relation", "description", *_POSITION)
_REQUIRED = COLUMNS[:4]
GONE = -1  # furniture of an object that has left the home


@dataclass(frozen=True, slots=True)
class Event:
    """From now on an object is there.

    Attributes:
        time_s: seconds since the time 0 of the recording.
        object: name that tells the object from all others, such as "mug 2".
        description: what it is called, such as "large red mug"; the same in all its events.
        furniture: index into the layout's furniture, or `GONE`.
        relation: by number in `RELATIONS`.
        position: where in the frame of the map its middle is since, x, y, z in metres; None where
            that is unknown.
    """

    time_s: float
    object: str
    description: str
    furniture: int
    relation: int
    position: Point | None = None


def load_events(path: Path, layout: Layout, start: datetime | None = None) -> tuple[Event, ...]:
    """Read an `events.csv`; rows may have dates if the start of the trace is known.

    Raises:
        ValueError: if it is missing or broken; names the file and the row.
    """
    try:
        text = read_part("events", path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"events must be UTF-8, got {error} in {path}. Save it as UTF-8."
        ) from None
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        return tuple(_read_rows(reader, layout, start))
    except csv.Error as error:
        raise ValueError(
            f"{path}, row {max(reader.line_num, 1)}: a row must be one of CSV, got {error}. Write "
            "it again."
        ) from None
    except ValueError as error:
        raise ValueError(
            f"{path}, row {max(reader.line_num, 1)}: {shorten_values(str(error))}"
        ) from None


def make_events_csv(events: Sequence[Event], layout: Layout) -> str:
    """Write events as the text of an `events.csv`, with positions where any is known."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    has_positions = any(event.position is not None for event in events)
    writer.writerow(COLUMNS if has_positions else COLUMNS[: -len(_POSITION)])
    named: set[str] = set()
    for event in events:
        time = int(event.time_s) if event.time_s == int(event.time_s) else event.time_s
        is_said = event.object in named or event.description == get_label(event.object)
        named.add(event.object)
        place = relation = ""
        if event.furniture != GONE:
            place, relation = layout.furniture[event.furniture].name, RELATIONS[event.relation]
        description = "" if is_said else event.description
        line = [time, event.object, place, relation, description]
        if has_positions:
            line += [""] * len(_POSITION) if event.position is None else event.position
        writer.writerow(line)
    return out.getvalue()


def _read_rows(
    rows: Iterator[list[str]], layout: Layout, start: datetime | None
) -> Iterator[Event]:
    header = [name.strip() for name in next(rows, [])]
    missing = [name for name in _REQUIRED if name not in header]
    unknown = [name for name in header if name not in COLUMNS]
    if missing or unknown or len(set(header)) < len(header):
        raise ValueError(
            f"events must have the columns {', '.join(_REQUIRED)} and perhaps "
            f"{', '.join(COLUMNS[len(_REQUIRED) :])}, got {', '.join(header) or 'nothing'}. Name "
            "them in the first row."
        )
    furniture = {read_words("name", piece.name): i for i, piece in layout.furniture.items()}
    known: dict[str, Event] = {}  # by the words of the object's name
    last = 0.0
    for cells in filter(None, rows):
        if len(cells) != len(header):
            raise ValueError(
                f"row must have {len(header)} cells, got {len(cells)}. "
                "Write texts that hold a comma in double quotes."
            )
        entry = dict(zip(header, cells, strict=True))
        time = _read_time(entry["time_s"], last, start)
        event = _read_row(entry, time, furniture, layout, known)
        known[read_words("object", event.object)] = event
        last = event.time_s
        yield event


def _read_row(
    entry: Mapping[str, str],
    time: float,
    furniture: Mapping[str, int],
    layout: Layout,
    known: Mapping[str, Event],
) -> Event:
    name = entry["object"].strip()
    before = known.get(read_words("object", name))
    description = (entry.get("description") or "").strip()
    if before is not None:
        if _get_spelling(name) != _get_spelling(before.object):
            raise ValueError(
                f"names must not differ in case alone, got {shorten(name)} after "
                f"{shorten(before.object)}. Write the same thing in the same way, or give another "
                "thing another name."
            )
        if description and (
            read_words("description", description) != read_words("description", before.description)
        ):
            raise ValueError(
                f"description of an object must stay the same, got {shorten(description)} for "
                f"{shorten(name)}, which was {shorten(before.description)}. Give another thing "
                "another name."
            )
        name, description = before.object, before.description
    elif description:
        read_words("description", description)
    else:
        description = get_label(name)
    if not entry["furniture"].strip():
        if before is None:
            raise ValueError(
                f"object must be somewhere before it is gone, got {shorten(name)} for the first "
                "time. Mend its name, or say first where it is."
            )
        return Event(time, name, description, GONE, before.relation)
    place = furniture.get(read_words("furniture", entry["furniture"]))
    if place is None:
        names = ", ".join(piece.name for piece in layout.furniture.values())
        raise ValueError(
            f"furniture must be in layout.json, got {shorten(entry['furniture'])}. Add it "
            f"there, or mend its name; known: {names}."
        )
    relation = RELATIONS.index(read_relation(entry["relation"]))
    return Event(time, name, description, place, relation, _read_position(entry, name))


def _read_position(entry: Mapping[str, str], name: str) -> Point | None:
    """Read x, y and z in metres; None where all of them are left out."""
    texts = [entry.get(side, "").strip() for side in _POSITION]
    if not any(texts):
        return None
    try:
        numbers = [float(text) for text in texts]
    except ValueError:
        raise ValueError(
            f"x, y, z must be three numbers or empty, got {shorten(', '.join(texts))} for "
            f"{shorten(name)}. Give metres in the frame of the map."
        ) from None
    return read_point(numbers, shorten(name))


def _read_time(text: str, last: float, start: datetime | None) -> float:
    """Read seconds since the start, or a date and time such as 2024-05-06T07:30."""
    try:
        time = float(text)
    except ValueError:
        time = _read_date(text, start)
    if not math.isfinite(time) or time < 0:
        raise ValueError(
            f"time_s must be a number of seconds >= 0, got {shorten(text)}. Mend the row."
        )
    if time < last:
        raise ValueError(f"time_s must not decrease, got {text} after {last:g}. Sort the rows.")
    return time


def _read_date(text: str, start: datetime | None) -> float:
    try:
        date = read_start(text.strip())
    except ValueError:
        return math.nan
    if start is None:
        raise ValueError(
            f"time_s must be in seconds where {LAYOUT_FILE} has no start, got {shorten(text)}. Add "
            'a line like "start": "2024-05-06T07:30".'
        )
    return (date - start).total_seconds()


def _get_spelling(name: str) -> str:
    """Return a name with its case, and all else as `read_words` compares it."""
    return " ".join(unicodedata.normalize("NFC", name).replace("_", " ").split())

"""Counts from a table of one's own: room, furniture, object, relation, weight."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sgm.files import parse_json, read_file
from sgm.messages import shorten
from simulator.priors.types import load_names, load_types
from tools.priors.counts import PlacementCounts

COLUMNS = ("room", "furniture", "object", "relation", "weight")
RELATIONS = {"ontop": "onTop", "on": "onTop", "in": "in", "inside": "in"}


def count_table(path: Path, *, skip_bad: bool = False) -> PlacementCounts:
    """Read a CSV file with a header, or a JSON list of objects.

    Columns: `furniture` and `object` are labels of the type tables; `room` may be empty (any room
    with the furniture), `relation` may be empty (the usual one of the furniture), `weight` is a
    number >= 0 (empty: 1). Rows of the same place add up; if all weights are whole they are counts.
    Everything else (sample probability, max count, move frequency, ...) comes from the type tables.

    Args:
        path: `.csv` or `.json`.
        skip_bad: note bad rows and go on.

    Raises:
        ValueError: names the file and row of a bad one, unless `skip_bad`.
    """
    path = Path(path)
    counts = PlacementCounts(path.stem, skips_bad=skip_bad)
    names, types = load_names("table"), load_types()
    for row_name, row in _read_rows(path):
        try:
            place = _read_row(row)
        except ValueError as error:
            counts.report(f"{error} at {path.name}:{row_name}", "Mend the row")
            continue
        counts.num_units += 1
        room_name, furniture_name, object_name, relation, weight = place
        room = names.find_room(room_name) if room_name else None
        furniture, label = names.find_furniture(furniture_name), names.find_object(object_name)
        if room_name and room is None:
            counts.outside["rooms"][room_name] += 1
        if furniture is None:
            counts.outside["furniture"][furniture_name] += 1
        if label is None:
            counts.outside["objects"][object_name] += 1
        if furniture is not None and label is not None and (room is not None or not room_name):
            relation = relation or types.furniture[furniture].relation
            counts.placements[room, furniture, label, relation] += weight
    counts.is_counted = all(weight == int(weight) for weight in counts.placements.values())
    return counts


def _read_rows(path: Path) -> Iterator[tuple[str, Any]]:
    """Yield (row name, row)."""
    try:
        text = read_file(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"table must be UTF-8, got {error} in {path.name}. Save it as UTF-8."
        ) from error
    if path.suffix.lower() == ".json":
        try:
            rows = parse_json(text)
        except ValueError as error:
            raise ValueError(f"table must be JSON, got {error} in {path.name}.") from error
        if not isinstance(rows, list):
            raise ValueError(f"table must be a JSON list of rows, got none in {path.name}.")
        for index, row in enumerate(rows):
            yield f"[{index}]", row
        return
    reader = csv.DictReader(text.splitlines())
    missing = {"furniture", "object"} - set(reader.fieldnames or [])
    if missing:
        raise ValueError(
            f"table must have the columns furniture and object, got "
            f"{shorten(reader.fieldnames)} in {path.name}. Name them in the first line: "
            f"{','.join(COLUMNS)}."
        )
    for row in reader:
        yield f"{reader.line_num}", row


def _read_row(row: Any) -> tuple[str, str, str, str | None, float]:
    if not isinstance(row, Mapping):
        raise ValueError(f"row must be an object, got {shorten(row)}")
    unknown = [str(column) for column in row if column not in COLUMNS]
    if unknown:
        raise ValueError(f"row must have the columns {', '.join(COLUMNS)}, got {shorten(unknown)}")
    texts = {column: str(row.get(column) or "").strip() for column in COLUMNS[:4]}
    for column in ("furniture", "object"):
        if not texts[column]:
            raise ValueError(f"{column} must be named, got nothing")
    relation = RELATIONS.get(texts["relation"].lower()) if texts["relation"] else None
    if texts["relation"] and relation is None:
        raise ValueError(f"relation must be onTop or in, got {shorten(texts['relation'])}")
    raw = row.get("weight")
    try:
        weight = 1.0 if raw is None or raw == "" else float(raw)
    except (TypeError, ValueError):
        weight = math.nan
    if not math.isfinite(weight) or weight < 0:
        raise ValueError(f"weight must be a number >= 0, got {shorten(raw)}")
    return texts["room"], texts["furniture"], texts["object"], relation, weight

"""Event tables on disk: CSV always, Parquet where pyarrow is installed, and TGB's own columns."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import (
    VERSION,
    VersionError,
    check_version,
    read_file,
    read_json,
    write_whole,
)
from sgm.messages import shorten, shorten_text
from sgm.schema import RELATIONS
from simulator.events.table import KINDS, EventQuestions, Events, EventTable, Nodes, Rows

MANIFEST = "events.json"
EVENTS, NODES, QUESTIONS = "events.csv", "nodes.csv", "questions.csv"
_MOST_BYTES = 1 << 32  # of a file
# What columns hold, by name: shares in [0, 1], names of numbers, texts, ids of nodes; others hold
# whole numbers.
_SHARES = ("coverage", "confidence")
_CHOICES: Mapping[str, Sequence[str]] = {
    "kind": KINDS,
    "relation": RELATIONS,
    "is_seen": ("0", "1"),
}
_TEXTS = ("label", "description", "room")
_IDS = ("thing", "place", "places")


def save_events(table: EventTable, folder: str | Path, settings: Mapping[str, Any]) -> list[str]:
    """Write a table; equal tables give equal bytes of CSV.

    Args:
        table: what is written.
        folder: made if needed.
        settings: of the collection, as JSON values.

    Returns:
        The names of the files; `events.parquet` is among them where pyarrow is installed.

    Raises:
        OSError: if a file cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    parts: dict[str, Any] = {EVENTS: table.events, NODES: table.nodes, QUESTIONS: table.questions}
    for name, rows in parts.items():
        columns = {
            column.name: _write(column.name, getattr(rows, column.name)) for column in fields(rows)
        }
        if name == NODES:
            columns = {"node": range(table.num_nodes), **columns}
        text = _make_csv(tuple(columns), zip(*columns.values(), strict=True))
        write_whole(folder / name, text.encode())
    names = list(parts)
    if importlib.util.find_spec("pyarrow") is not None:
        names.append("events.parquet")
        write_whole(folder / names[-1], _make_parquet(table))
    content = {
        "version": VERSION,
        "step_seconds": table.step_seconds,
        "settings": dict(settings),
        "num_events": len(table.events.home),
        "num_nodes": table.num_nodes,
    }
    # Last: a folder with one is whole.
    write_whole(folder / MANIFEST, (json.dumps(content, indent=1) + "\n").encode())
    return [*names, MANIFEST]


def load_events(folder: str | Path) -> EventTable:
    """Read what `save_events` wrote, from the CSV files.

    Raises:
        ValueError: if a file is missing or damaged; names the file and the row.
    """
    folder = Path(folder)
    manifest = read_manifest(folder)
    path = folder / NODES
    found = _read_columns(path, Nodes, ("node",))
    if found.pop("node").tolist() != list(range(len(found["kind"]))):
        raise _make_error("node ids must be 0, 1, 2 and so on", "others", path)
    nodes = Nodes(**found)
    events = _read_columns(folder / EVENTS, Events, num_nodes=len(nodes.kind))
    events["is_seen"] = events["is_seen"].astype(bool)
    questions = _read_columns(folder / QUESTIONS, EventQuestions, num_nodes=len(nodes.kind))
    seconds = manifest["step_seconds"]
    return EventTable(Events(**events), nodes, EventQuestions(**questions), seconds)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read what a folder of events says of itself.

    Raises:
        ValueError: if there is none, or it is one of another version.
    """
    path = folder / MANIFEST
    try:
        found = read_json(path)
        check_version("events", found["version"], path)
        seconds = found["step_seconds"]
        if not isinstance(found["settings"], dict) or isinstance(seconds, (str, list, dict)):
            raise TypeError("settings or step_seconds of another kind")
    except VersionError:
        raise
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise _make_error("events must have a manifest that can be read", error, path) from None
    return dict(found)


def save_tgb(table: EventTable, folder: str | Path, name: str) -> list[str]:
    """Write a table as TGB's temporal heterogeneous graphs: an edge list and the types of nodes.

    Columns are `timestamp,head,tail,relation_type` and `node_id,type`; relation types are
    `2 * relation + (0 where the thing was not seen)`: 0 not in, 1 in, 2 not on top, 3 on top.

    Args:
        table: what is written, in its order.
        folder: made if needed.
        name: of the dataset, such as "thgl-homes".

    Returns:
        The names of the files.
    """
    events = table.events
    types = make_edge_types(events)
    rows = zip(events.time, events.thing, events.place, types, strict=True)
    texts = {
        f"{name}_edgelist.csv": _make_csv(("timestamp", "head", "tail", "relation_type"), rows),
        f"{name}_nodetype.csv": _make_csv(("node_id", "type"), enumerate(table.nodes.kind)),
    }
    Path(folder).mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        write_whole(Path(folder) / file, text.encode())
    return list(texts)


def make_edge_types(events: Events) -> np.ndarray:
    """Return one number for relation and sign, see `save_tgb`, int (E,)."""
    return (2 * events.relation + events.is_seen).astype(np.int64)


def _write(name: str, column: Any) -> Iterable[Any]:
    """Return a column as CSV has it."""
    if name == "places":
        return (" ".join(map(str, places)) for places in column)
    if name in _SHARES:
        return (format(value, ".6g") for value in column)
    if name in _CHOICES:
        return (_CHOICES[name][int(number)] for number in column)
    return column.tolist()


def _make_csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()


def _make_parquet(table: EventTable) -> bytes:
    """Return the events alone: nodes and questions are small."""
    import pyarrow as pa
    from pyarrow import parquet

    columns = {column.name: getattr(table.events, column.name) for column in fields(Events)}
    columns["relation"] = np.array(RELATIONS, dtype=object)[table.events.relation]
    out = io.BytesIO()
    parquet.write_table(pa.table(columns), out)
    return out.getvalue()


def _read_columns(
    path: Path, table: type[Rows], more: Sequence[str] = (), num_nodes: int | None = None
) -> dict[str, Any]:
    """Read `more` columns of a file, then the fields; ids of nodes are below `num_nodes`."""
    names = (*more, *(column.name for column in fields(table)))
    try:
        rows = list(csv.reader(io.StringIO(read_file(path, _MOST_BYTES).decode()), strict=True))
    except (OSError, ValueError, csv.Error) as error:
        raise _make_error("events must be CSV files that can be read", error, path) from None
    if not rows or tuple(rows[0]) != names:
        found = ", ".join(rows[0]) if rows else "nothing"
        raise _make_error(f"columns must be {', '.join(names)}", found, path)
    for number, line in enumerate(rows[1:], 2):
        if len(line) != len(names):
            raise _make_error(f"row {number} must have {len(names)} cells", len(line), path)
    columns: dict[str, Any] = {}
    for place, name in enumerate(names):
        cells = [line[place] for line in rows[1:]]
        if name in _TEXTS:
            columns[name] = np.array(cells, dtype=object)
        elif name in _CHOICES:
            columns[name] = _read_choices(cells, name, path)
        elif name == "places":
            words = [cell.split() for cell in cells]
            all_words = [word for ids in words for word in ids]
            each = iter(_read_numbers(all_words, name, path, num_nodes).tolist())
            columns[name] = tuple(tuple(islice(each, len(ids))) for ids in words)
        else:
            columns[name] = _read_numbers(cells, name, path, num_nodes)
    return columns


def _read_numbers(cells: Sequence[str], name: str, path: Path, num_nodes: int | None) -> np.ndarray:
    is_share = name in _SHARES
    try:
        values = np.array(cells, dtype=float if is_share else np.int64)
    except (ValueError, OverflowError) as error:
        wanted = {"places": "node ids"}.get(name, "numbers" if is_share else "whole numbers")
        raise _make_error(f"{name} must be {wanted}", error, path) from None
    is_wrong = ~((values >= 0) & (values <= 1)) if is_share else values < 0
    if is_wrong.any():
        first = int(np.flatnonzero(is_wrong)[0])
        bound = "lie in [0, 1]" if is_share else "be at least 0"
        raise _make_error(f"{name} of row {first + 2} must {bound}", cells[first], path)
    if name in _IDS and num_nodes is not None and values.max(initial=-1) >= num_nodes:
        raise _make_error(f"{name} must be a node id below {num_nodes}", int(values.max()), path)
    return values


def _read_choices(cells: Sequence[str], name: str, path: Path) -> np.ndarray:
    known = {value: number for number, value in enumerate(_CHOICES[name])}
    for number, value in enumerate(cells, 2):
        if value not in known:
            rule = f"{name} of row {number} must be one of {', '.join(known)}"
            raise _make_error(rule, value, path)
    return np.array([known[value] for value in cells], dtype=np.int64)


def _make_error(rule: str, found: object, path: Path) -> ValueError:
    """Return an error; what another error says stands in it as it is."""
    shown = shorten_text(str(found)) if isinstance(found, Exception) else shorten(found)
    return ValueError(
        f"{rule}, got {shown} in {path}. Collect again with "
        "`python -m simulator.collect --format events`."
    )

"""Event tables on disk: CSV always, Parquet where pyarrow is installed, and TGB's own columns."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import read_file, read_json, write_whole
from sgm.memory.sighting import RELATIONS
from sgm.messages import shorten, shorten_text
from simulator.events.table import KINDS, EventQuestions, Events, EventTable, Nodes

MANIFEST = "events.json"
EVENTS, NODES, QUESTIONS = "events.csv", "nodes.csv", "questions.csv"
VERSION = 1
_MOST_BYTES = 1 << 32  # of a file
_SHARES = ("coverage", "confidence")
_NODE_COLUMNS = ("node", *(row.name for row in fields(Nodes)))
_EVENT_COLUMNS = tuple(row.name for row in fields(Events))
_QUESTION_COLUMNS = tuple(row.name for row in fields(EventQuestions))


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
    texts = {EVENTS: _write_events(table), NODES: _write_nodes(table)}
    texts[QUESTIONS] = _write_questions(table)
    for name, text in texts.items():
        write_whole(folder / name, text.encode())
    names = list(texts)
    if importlib.util.find_spec("pyarrow") is not None:
        names.append("events.parquet")
        write_whole(folder / names[-1], _make_parquet(table))
    content = {
        "version": VERSION, "step_seconds": table.step_seconds, "settings": dict(settings),
        "num_events": len(table.events.home), "num_nodes": table.num_nodes,
    }  # fmt: skip
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
    nodes = _read(folder / NODES, _NODE_COLUMNS)
    kinds = {name: number for number, name in enumerate(KINDS)}
    node_rows = Nodes(
        _read_numbers(nodes, "home", folder / NODES),
        _read_choices(nodes, "kind", kinds, folder / NODES),
        *(np.array(nodes[name], dtype=object) for name in ("label", "description", "room")),
    )
    num_nodes = len(node_rows.kind)
    if _read_numbers(nodes, "node", folder / NODES).tolist() != list(range(num_nodes)):
        raise _make_error("node ids must be 0, 1, 2 and so on", "others", folder / NODES)
    path = folder / EVENTS
    found = _read(path, _EVENT_COLUMNS)
    relations = {name: number for number, name in enumerate(RELATIONS)}
    columns: dict[str, np.ndarray] = {}
    for name in _EVENT_COLUMNS:
        if name == "relation":
            columns[name] = _read_choices(found, name, relations, path)
        elif name == "is_seen":
            columns[name] = _read_choices(found, name, {"0": 0, "1": 1}, path).astype(bool)
        else:
            columns[name] = _read_numbers(found, name, path, name in _SHARES)
    _check_ids(columns["thing"], num_nodes, "thing", path)
    _check_ids(columns["place"], num_nodes, "place", path)
    path = folder / QUESTIONS
    asked = _read(path, _QUESTION_COLUMNS)
    home, time, look, thing = (_read_numbers(asked, name, path) for name in _QUESTION_COLUMNS[:-1])
    try:
        places = tuple(tuple(map(int, text.split())) for text in asked["places"])
    except ValueError as error:
        raise _make_error("places must be node ids", error, path) from None
    _check_ids(thing, num_nodes, "thing", path)
    _check_ids(np.array([p for row in places for p in row], dtype=np.int64), num_nodes, "places",
               path)  # fmt: skip
    seconds = manifest["step_seconds"]
    questions = EventQuestions(home, time, look, thing, places)
    return EventTable(Events(**columns), node_rows, questions, seconds)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read what a folder of events says of itself.

    Raises:
        ValueError: if there is none, or it is one of another version.
    """
    path = folder / MANIFEST
    try:
        found = read_json(path)
        version, seconds = found["version"], found["step_seconds"]
        if not isinstance(found["settings"], dict) or isinstance(seconds, (str, list, dict)):
            raise TypeError("settings or step_seconds of another kind")
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise _make_error("events must have a manifest that can be read", error, path) from None
    if version != VERSION:
        raise _make_error(f"version of events must be {VERSION}", version, path)
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


def _write_events(table: EventTable) -> str:
    events = table.events
    columns: list[Iterable[Any]] = []
    for name in _EVENT_COLUMNS:
        column = getattr(events, name)
        if name == "relation":
            columns.append(RELATIONS[number] for number in column)
        elif name in _SHARES:
            columns.append(format(value, ".6g") for value in column)
        else:
            columns.append(column.astype(np.int64).tolist())
    return _make_csv(_EVENT_COLUMNS, zip(*columns, strict=True))


def _write_nodes(table: EventTable) -> str:
    nodes = table.nodes
    rows = zip(
        range(table.num_nodes), nodes.home, (KINDS[kind] for kind in nodes.kind), nodes.label,
        nodes.description, nodes.room, strict=True,
    )  # fmt: skip
    return _make_csv(_NODE_COLUMNS, rows)


def _write_questions(table: EventTable) -> str:
    asked = table.questions
    places = (" ".join(map(str, row)) for row in asked.places)
    return _make_csv(
        _QUESTION_COLUMNS, zip(asked.home, asked.time, asked.look, asked.thing, places, strict=True)
    )


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

    columns = {name: getattr(table.events, name) for name in _EVENT_COLUMNS}
    columns["relation"] = np.array(RELATIONS, dtype=object)[table.events.relation]
    out = io.BytesIO()
    parquet.write_table(pa.table(columns), out)
    return out.getvalue()


def _read(path: Path, wanted: Sequence[str]) -> dict[str, list[str]]:
    try:
        text = read_file(path, _MOST_BYTES).decode()
    except (OSError, ValueError) as error:
        raise _make_error("events must be files that can be read", error, path) from None
    try:
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise _make_error("events must be CSV", error, path) from None
    if not rows or tuple(rows[0]) != tuple(wanted):
        found = ", ".join(rows[0]) if rows else "nothing"
        raise _make_error(f"columns must be {', '.join(wanted)}", found, path)
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(wanted):
            raise _make_error(f"row {number} must have {len(wanted)} cells", len(row), path)
    return {name: [row[place] for row in rows[1:]] for place, name in enumerate(wanted)}


def _read_numbers(
    found: Mapping[str, list[str]], name: str, path: Path, is_share: bool = False
) -> np.ndarray:
    try:
        values = np.array(found[name], dtype=float if is_share else np.int64)
    except (ValueError, OverflowError) as error:
        raise _make_error(f"{name} must be {'' if is_share else 'whole '}numbers", error,
                          path) from None  # fmt: skip
    is_wrong = ~((values >= 0) & (values <= 1)) if is_share else values < 0
    if is_wrong.any():
        first = int(np.flatnonzero(is_wrong)[0])
        bound = "lie in [0, 1]" if is_share else "be at least 0"
        raise _make_error(f"{name} of row {first + 2} must {bound}", found[name][first], path)
    return values


def _read_choices(
    found: Mapping[str, list[str]], name: str, known: Mapping[str, int], path: Path
) -> np.ndarray:
    for number, value in enumerate(found[name], 2):
        if value not in known:
            raise _make_error(f"{name} of row {number} must be one of {', '.join(known)}", value,
                              path)  # fmt: skip
    return np.array([known[value] for value in found[name]], dtype=np.int64)


def _check_ids(ids: np.ndarray, num_nodes: int, name: str, path: Path) -> None:
    if len(ids) and ids.max() >= num_nodes:
        raise _make_error(f"{name} must be a node id below {num_nodes}", int(ids.max()), path)


def _show(found: object) -> str:
    """Return a value for a message; what another error says as it is."""
    return shorten_text(str(found)) if isinstance(found, Exception) else shorten(found)


def _make_error(rule: str, found: object, path: Path) -> ValueError:
    return ValueError(
        f"{rule}, got {_show(found)} in {path}. Collect again with "
        "`python -m simulator.collect --format events`."
    )

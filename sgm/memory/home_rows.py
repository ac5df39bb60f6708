"""What a memory writes into the tables that people read: of an event, and of all that it holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sgm.layout.layout import Layout
from sgm.memory.clock import Clock
from sgm.memory.sighting import Sighting
from sgm.memory.thing import Thing, ThingName
from sgm.names.name import Name
from sgm.schema import RELATIONS, Columns
from sgm.store.event_kinds import STATEMENTS
from sgm.store.event_rows import SightingRow, find_point
from sgm.store.new_file import fill_new, write_new
from sgm.store.snapshot import Snapshot

Values = Mapping[str, Any]
Tables = Mapping[str, Columns]


def make_key(thing: ThingName) -> str:
    """Return what tells a thing from others: its id, or its words."""
    return f"#{thing.id}" if thing.id else " ".join(Name.read(thing.description).key)


def write_clock(clock: Clock | None) -> dict[str, Any]:
    """Return the columns of a clock."""
    if clock is None:
        return {"clock_start": None, "step_seconds": None}
    return {"clock_start": clock.start.isoformat(), "step_seconds": clock.step_seconds}


def write_home_file(
    path: Path,
    prior: str,
    clock: Clock | None,
    layout: Layout,
    things: Sequence[Thing],
    tables: Tables,
    snapshot: Snapshot,
) -> None:
    """Write a new file; an older one is replaced by a whole new one.

    Args:
        path: of the file.
        prior: checksum of the prior.
        clock: None if it is unknown what time it is.
        layout: rooms and furniture.
        things: the objects.
        tables: columns by table.
        snapshot: all of these, and what else the memory holds.

    Raises:
        ValueError: if a memory has the older file, in this process or another one.
        OSError: if the disk does not take it; the older file is as it was.
    """
    settings = {"prior": prior, "map": layout.map_id, **write_clock(clock)}
    rooms = [(int(number), room.label, 1) for number, room in layout.rooms.items()]
    places = list_place_rows(layout, tables)
    named = [(make_key(thing.name), thing.description, thing.id) for thing in things]
    sightings = list_sighting_rows(layout, things, tables)
    write_new(
        path, lambda made: fill_new(made, settings, snapshot, rooms, places, named, sightings)
    )


def find_keys(kind: str, values: Values) -> dict[str, Any]:
    """Return the arguments of an event of a kind with the keys of the things that they name."""
    if "description" not in values or ("furniture" in values and "label" in values):
        return dict(values)
    thing = ThingName.from_json(values)
    found = dict(values, key=make_key(thing))
    if isinstance(values.get("other"), Mapping):
        found["other_key"] = make_key(ThingName.from_json(values["other"]))
    if "name" in values:
        kept = thing.id if kind == "rename" else ""  # what is split off has words alone
        found["new_key"] = make_key(ThingName(values["name"], kept))
    return found


def list_seen_rows(furniture: int, seen: Iterable[Sighting]) -> list[SightingRow]:
    """Return the rows of a look, whose sightings have probabilities."""
    return [
        SightingRow(
            key=f"#{sighting.id}" if sighting.id else " ".join(sighting.name.key),
            name=sighting.description,
            tracker=sighting.id or "",
            place=furniture,
            relation=sighting.relation,
            confidence=sighting.confidence,
            position=sighting.position,
        )
        for sighting in seen
    ]


def list_said_rows(kind: str, values: Values) -> list[SightingRow]:
    """Return the row of what was said of a thing; none of other events."""
    if kind not in STATEMENTS:
        return []
    thing = ThingName.from_json(values)
    row = SightingRow(
        key=make_key(thing),
        name=thing.description,
        tracker=thing.id,
        place=None if values["furniture"] is None else int(values["furniture"]),
        relation=values["relation"],
        confidence=float(values["confidence"]),
        said=kind,
        by=values["by"],
    )
    return [row]


def list_place_rows(layout: Layout, tables: Tables) -> list[tuple[Any, ...]]:
    """Return the rows of all furniture."""
    furniture = tables["furniture"]
    num_looks, last = furniture["num_observed"].tolist(), furniture["last_observed"].tolist()
    return [
        (
            number,
            piece.label,
            piece.description,
            int(piece.room),
            *find_point(piece.position, piece.box),
            int(num_looks[place]),
            None if last[place] < 0 else int(last[place]),
            1,
        )
        for place, (number, piece) in enumerate(layout.furniture.items())
    ]


def list_sighting_rows(
    layout: Layout, things: Sequence[Thing], tables: Tables
) -> list[SightingRow]:
    """Return the last sighting of every thing at each place, and what was said of it, in order."""
    ids = list(layout.furniture)
    keys = [make_key(thing.name) for thing in things]
    points = _list_points(tables)
    rows: list[SightingRow] = []
    said: set[tuple[int, int | None, int]] = set()
    for number, thing in enumerate(things):
        for statement in thing.statements:
            said.add((number, statement.furniture, statement.time))
            rows.append(
                SightingRow(
                    key=keys[number],
                    name=thing.description,
                    tracker=thing.id,
                    place=statement.furniture,
                    relation=statement.relation,
                    confidence=statement.confidence,
                    said=statement.kind,
                    by=statement.by,
                    time=statement.time,
                )
            )
    edges = tables["edges"]
    columns = ("object", "furniture", "relation", "last_true", "confidence")
    seen = np.flatnonzero(edges["num_true"] > 0)
    for number, place, relation, time, sure in zip(
        *(edges[name][seen].tolist() for name in columns), strict=True
    ):
        if (number, ids[place], time) not in said:
            rows.append(
                SightingRow(
                    key=keys[number],
                    name=things[number].description,
                    tracker=things[number].id,
                    place=ids[place],
                    relation=RELATIONS[relation],
                    confidence=sure,
                    position=points.get((number, place, relation)),
                    time=int(time),
                )
            )
    return sorted(rows, key=lambda row: row.time or 0)


def _list_points(tables: Tables) -> dict[tuple[int, int, int], Sequence[float]]:
    """Return the last positions by object, place and relation."""
    table = tables["positions"]
    columns = ("object", "furniture", "relation", "time", "x", "y", "z")
    rows = zip(*(table[name].tolist() for name in columns), strict=True)
    return {
        (number, place, relation): point
        for number, place, relation, time, *point in rows
        if time >= 0
    }

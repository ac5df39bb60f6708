"""Lists of places and of things, k rows at most."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import TypeVar

from sgm.finder.answers import (
    ChangeList,
    ChangeRow,
    EventList,
    EventRow,
    Moment,
    PlaceList,
    PlaceRow,
    ThingList,
    ThingRow,
)
from sgm.finder.finder import Finder
from sgm.finder.meanings import Unclear, ask_room, doubt, find_place, find_rooms
from sgm.finder.where import tell_name
from sgm.memory.scene_graph_memory import SceneGraphMemory

_List = TypeVar("_List", PlaceList, ThingList, EventList)


def list_places(memory: SceneGraphMemory, room: str | None, k: int) -> PlaceList:
    """List places; `MemoryService.list_places` says what the arguments are."""
    rooms = None if room is None else find_rooms(memory, room)
    if room is not None and not rooms:
        return _cut(PlaceList, memory, [], k, memory.time, ask_room(memory, room, []))
    home, layout = memory.to_dict(), memory.layout
    now, rows = home["time"], []
    for own in home["rooms"]:
        for node in own["furniture"]:
            is_left_out = rooms is not None and own["id"] not in rooms
            if is_left_out or node["id"] not in layout.furniture:  # removed meanwhile
                continue
            looked = node["last_looked"]
            rows.append(
                PlaceRow(
                    place=node["id"],
                    name=layout.describe(node["id"]),
                    room=str(layout.rooms[layout.furniture[node["id"]].room]),
                    label=node["label"],
                    position=layout.furniture[node["id"]].position,
                    last_looked=None if looked is None else _tell(memory, looked, now),
                    things=sum(seen["is_there"] for seen in node["objects"]),
                )
            )
    rows.sort(key=lambda row: row.place)
    return _cut(PlaceList, memory, rows, k, now)


def list_things(
    memory: SceneGraphMemory, finder: Finder, place: int | str | None, kind: str | None, k: int
) -> ThingList:
    """List things; `MemoryService.list_things` says what the arguments are."""
    matches: Sequence[str] | None = None
    try:
        found = None if place is None else find_place(memory, place)
        if kind is not None:
            resolution = finder.resolve(memory, kind)
            matches, unknown = resolution.matches, doubt(resolution)
            if unknown is not None and not matches:
                raise unknown
    except Unclear as unclear:
        return _cut(ThingList, memory, [], k, memory.time, unclear)
    rows = _list_rows(memory, matches)
    if found is not None:
        rows = [row for row in rows if row.place == found and row.is_there]
    else:
        rows = _keep_current(rows)
    return _cut(ThingList, memory, rows, k, memory.time)


def list_history(memory: SceneGraphMemory, finder: Finder, thing: str, k: int) -> EventList:
    """List what is known of a thing; `MemoryService.history` says what the arguments are."""
    resolution, now = finder.resolve(memory, thing), memory.time
    unclear = doubt(resolution)
    matches = resolution.matches if unclear is None else ()
    rows = [
        EventRow(
            thing=match,
            what=event.kind,
            place=event.furniture,
            name=tell_name(memory, event.furniture),
            relation=event.relation,
            confidence=event.confidence,
            by=event.by,
            at=_tell(memory, event.time, now),
        )
        for match in matches
        for event in memory.history(match)
    ]
    rows.sort(key=lambda row: -row.at.step)
    return _cut(EventList, memory, rows, k, now, unclear)


def list_changes(memory: SceneGraphMemory, since: datetime | int, k: int) -> ChangeList:
    """List what has changed; `MemoryService.changes` says what the arguments are."""
    changes, now = memory.changes(since), memory.time
    rows = tuple(
        ChangeRow(
            what=change.kind,
            thing=change.thing,
            thing_id=change.id,
            from_place=change.from_place,
            from_name=tell_name(memory, change.from_place),
            to_place=change.to_place,
            to_name=tell_name(memory, change.to_place),
            after=None if change.after is None else _tell(memory, change.after, now),
            at=_tell(memory, change.time, now),
            probability=change.probability,
            by=change.by,
        )
        for change in changes[:k]
    )
    return ChangeList("ok", rows, max(len(changes) - k, 0), _tell(memory, now, now))


def _list_rows(memory: SceneGraphMemory, things: Sequence[str] | None) -> list[ThingRow]:
    """List all places where things were ever seen, the latest first; None for all things."""
    home = memory.to_dict()
    now, wanted = home["time"], None if things is None else set(things)
    rows = [
        ThingRow(
            thing=seen["description"],
            place=node["id"],
            name=tell_name(memory, node["id"]),
            relation=seen["relation"],
            is_there=seen["is_there"],
            times_seen=seen["times_seen"],
            times_looked=seen["times_looked"],
            last_seen=_tell(memory, seen["last_seen"], now),
        )
        for room in home["rooms"]
        for node in room["furniture"]
        for seen in node["objects"]
        if wanted is None or seen["description"] in wanted
    ]
    for seen in home["unplaced"]:
        if wanted is None or seen["description"] in wanted:
            last = _tell(memory, seen["last_seen"], now)
            rows.append(ThingRow(seen["description"], None, "", "", False, 0, 0, last))
    return sorted(rows, key=lambda row: (-row.last_seen.step, row.thing))


def _keep_current(rows: Sequence[ThingRow]) -> list[ThingRow]:
    """Keep of each thing where it is, or if it is nowhere, where it was seen last."""
    placed = {row.thing for row in rows if row.is_there}
    kept, told = [], set()
    for row in rows:  # the latest first
        if row.is_there or (row.thing not in placed and row.thing not in told):
            kept.append(row)
            told.add(row.thing)
    return kept


def _cut(
    kind: type[_List], memory: SceneGraphMemory, rows: Sequence[object], k: int, now: int,
    unclear: Unclear | None = None,
) -> _List:  # fmt: skip
    """Return a list of k rows at most, or what to ask."""
    more = () if unclear is None else (unclear.ask, unclear.candidates)
    status = "ok" if unclear is None else unclear.status
    return kind(status, tuple(rows[:k]), max(len(rows) - k, 0), _tell(memory, now, now), *more)  # type: ignore[arg-type]


def _tell(memory: SceneGraphMemory, step: int, now: int | None = None) -> Moment:
    return Moment.tell(step, memory.time if now is None else now, memory.clock)

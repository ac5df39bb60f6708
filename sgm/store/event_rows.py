"""What an event changes in the tables that people read."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from sgm.store.event_kinds import START, get_by_kind

Values = Mapping[str, Any]
_MOST_ASKED = 500  # things at once: older builds of SQLite take 999 values


class SightingRow(NamedTuple):
    """Where a thing is, as a look or a person says.

    Attributes:
        key: what tells the thing from others.
        name: of the thing.
        tracker: its id; empty without one.
        place: id of the furniture; None with the robot.
        relation: to it.
        confidence: probability that it is right.
        position: x, y, z in the map, metres; None if unknown.
        said: kind of the statement; None of what was seen.
        by: who said so.
        time: time step, where that is not the present one.
    """

    key: str
    name: str
    tracker: str
    place: int | None
    relation: str | None
    confidence: float
    position: Sequence[float] | None = None
    said: str | None = None
    by: str | None = None
    time: int | None = None


def write_rows(
    connection: sqlite3.Connection, number: int, time: int, kind: str, values: Values
) -> None:
    """Take over what an event says of rooms, places and things."""
    change = get_by_kind(CHANGES, kind, __name__)
    if change is not None:
        change(connection.execute, values)
    if kind == "look":
        connection.execute(
            "UPDATE places SET num_looks = num_looks + 1, last_look = ? WHERE place = ?",
            (time, int(values["furniture"])),
        )


def write_sightings(
    connection: sqlite3.Connection,
    numbers: Iterable[int],
    time: int,
    rows: Sequence[SightingRow],
    known: dict[str, int],
) -> None:
    """Write where things are by events.

    Args:
        connection: of the file.
        numbers: of the event of each row.
        time: time step of those that have none.
        rows: in the order in which they were seen or said.
        known: numbers of things by their keys, to which new ones are added.
    """
    _number_things(connection, rows, known)
    seen, others = [], []
    for nth, (number, row) in enumerate(zip(numbers, rows, strict=False)):
        seen_at = time if row.time is None else row.time
        about = known[row.key], seen_at, number, nth, row.place, row.relation, row.confidence
        if row.position is None and row.said is None and row.by is None:
            seen.append(about)
        else:
            point = (None, None, None) if row.position is None else tuple(row.position)
            others.append((*about, *point, row.said, row.by))
    # To bind a None takes `sqlite3` as long as seven numbers: what is seen leaves them out.
    columns = "thing, time, event, nth, place, relation, confidence"
    connection.executemany(
        f"INSERT INTO sighting_rows ({columns}) VALUES (?, ?, ?, ?, ?, ?, ?)", seen
    )
    if others:
        connection.executemany(
            "INSERT INTO sighting_rows VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", others
        )


def _number_things(
    connection: sqlite3.Connection, rows: Sequence[SightingRow], known: dict[str, int]
) -> None:
    """Add the numbers of things to those that are known; all are in the table from now on."""
    keys = list({row.key for row in rows if row.key not in known})
    if not keys:
        return
    for first in range(0, len(keys), _MOST_ASKED):
        some = keys[first : first + _MOST_ASKED]
        marks = ",".join("?" * len(some))
        known.update(
            connection.execute(f"SELECT key, thing FROM things WHERE key IN ({marks})", some)
        )
    for row in rows:
        if row.key not in known:
            made = connection.execute(
                "INSERT INTO things (key, name, tracker, is_known) VALUES (?, ?, ?, 1)",
                (row.key, row.name, row.tracker),
            )
            assert made.lastrowid is not None
            known[row.key] = made.lastrowid


def configure_home(connection: sqlite3.Connection, values: Values) -> None:
    """Say which prior, map and clock the home has from now on."""
    for column in ("prior", "map", "clock_start", "step_seconds"):
        if column in values:
            connection.execute(f"UPDATE home SET {column} = ?", (values[column],))


def find_point(position: Any, box: Any) -> tuple[float | None, float | None]:
    """Return x, y of furniture: where one stands to look at it, else its middle."""
    if position is not None:
        return float(position[0]), float(position[1])
    if box is not None:
        return float(box.center[0]), float(box.center[1])
    return None, None


def _add_room(execute: Any, values: Values) -> None:
    execute("INSERT INTO rooms VALUES (?, ?, 1)", (int(values["room"]), values["label"]))


def _rename_room(execute: Any, values: Values) -> None:
    room = int(values["room"])
    execute("UPDATE rooms SET label = ? WHERE room = ?", (values["label"], room))


def _remove_room(execute: Any, values: Values) -> None:
    for table in ("rooms", "places"):
        execute(f"UPDATE {table} SET is_there = 0 WHERE room = ?", (int(values["room"]),))


def _add_place(execute: Any, values: Values) -> None:
    label = values["label"]
    name, point = values["description"] or label, find_point(values["position"], values["box"])
    row = (int(values["furniture"]), label, name, int(values["room"]), *point)
    execute("INSERT INTO places VALUES (?, ?, ?, ?, ?, ?, 0, NULL, 1)", row)


def _move_place(execute: Any, values: Values) -> None:
    point = find_point(values["position"], values["box"])
    row = (int(values["room"]), *point, int(values["furniture"]))
    execute("UPDATE places SET room = ?, x = ?, y = ? WHERE place = ?", row)


def _name_place(execute: Any, values: Values) -> None:
    label = values["label"]
    row = (label, values["description"] or label, int(values["furniture"]))
    execute("UPDATE places SET label = ?, name = ? WHERE place = ?", row)


def _merge_places(execute: Any, values: Values) -> None:
    kept, gone = int(values["furniture"]), int(values["other"])
    execute("UPDATE places SET is_there = 0 WHERE place = ?", (gone,))
    execute("UPDATE sighting_rows SET place = ? WHERE place = ?", (kept, gone))
    execute(
        "UPDATE places SET num_looks = num_looks + (SELECT num_looks FROM places WHERE place = ?), "
        "last_look = max(coalesce(last_look, -1), "
        "coalesce((SELECT last_look FROM places WHERE place = ?), -1)) WHERE place = ?",
        (gone, gone, kept),
    )
    execute("UPDATE places SET last_look = NULL WHERE place = ? AND last_look < 0", (kept,))


def _remove_place(execute: Any, values: Values) -> None:
    execute("UPDATE places SET is_there = 0 WHERE place = ?", (int(values["furniture"]),))


def _transform(execute: Any, values: Values) -> None:
    cosine, sine = math.cos(values["angle"]), math.sin(values["angle"])
    turn = {"c": cosine, "s": sine, "x": float(values["shift"][0]), "y": float(values["shift"][1])}
    for table in ("places", "sighting_rows"):
        execute(
            f"UPDATE {table} SET x = :c * x - :s * y + :x, y = :s * x + :c * y + :y "
            "WHERE x IS NOT NULL",
            turn,
        )
    execute("UPDATE home SET map = ?", (values["map_id"],))


def _rename_thing(execute: Any, values: Values) -> None:
    execute(
        "UPDATE OR IGNORE things SET name = ?, key = ? WHERE key = ?",
        (values["name"], values["new_key"], values["key"]),
    )


def _merge_things(execute: Any, values: Values) -> None:
    execute(
        "UPDATE things SET same_as = (SELECT thing FROM things WHERE key = ?) WHERE key = ?",
        (values["key"], values["other_key"]),
    )


def _split_things(execute: Any, values: Values) -> None:
    execute(
        "UPDATE things SET same_as = NULL WHERE key = :key OR same_as = "
        "(SELECT thing FROM things WHERE key = :key)",
        {"key": values["key"]},
    )


def _split_off(execute: Any, values: Values) -> None:
    number = "(SELECT thing FROM things WHERE key = ?)"
    execute(
        "INSERT OR IGNORE INTO things (key, name, tracker, is_known) VALUES (?, ?, '', 1)",
        (values["new_key"], values["name"]),
    )
    execute(
        f"UPDATE sighting_rows SET thing = {number} WHERE place = ? AND thing = {number}",
        (values["new_key"], int(values["furniture"]), values["key"]),
    )


def _forget_thing(execute: Any, values: Values) -> None:
    # What is seen under its name later is another thing, of which nothing older is listed.
    number = "(SELECT thing FROM things WHERE key = :key)"
    execute(
        "UPDATE things SET is_known = 0, key = key || ' (forgotten ' || thing || ')' "
        f"WHERE key = :key OR same_as = {number}",
        {"key": values["key"]},
    )


# By kind: what it changes of rooms, places and things; None where it names no other ones.
CHANGES: Mapping[str, Callable[[Any, Values], None] | None] = {
    "room": _add_room,
    "rename_room": _rename_room,
    "remove_room": _remove_room,
    "furniture": _add_place,
    "move": _move_place,
    "name": _name_place,
    "merge_furniture": _merge_places,
    "remove_furniture": _remove_place,
    "transform": _transform,
    "rename": _rename_thing,
    "merge": _merge_things,
    "split": _split_things,
    "split_off": _split_off,
    "remove_object": _forget_thing,
    **dict.fromkeys(("look", "moved", "picked_up", "put_down"), None),  # sightings are written
    **dict.fromkeys((START, "absent", "query", "step", "configure"), None),
}

"""Where a thing was, by all sightings and statements that a memory file keeps."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import NamedTuple, Protocol

_MOST_KEYS = 500  # older builds of SQLite take 999 values
# Of a place that was removed nothing is listed, as in a memory without a file.
_IS_THERE = "(place IS NULL OR place IN (SELECT place FROM places WHERE is_there))"


class StoredSighting(NamedTuple):
    """A sighting, or what was said of a thing.

    Attributes:
        time: time step.
        place: id of the furniture; None with the robot.
        relation: to it.
        confidence: probability that it is right.
        said: kind of the statement; None of what was seen.
        by: who said so.
    """

    time: int
    place: int | None
    relation: str | None
    confidence: float
    said: str | None
    by: str | None


_COLUMNS = ", ".join(StoredSighting._fields)


class Past(Protocol):
    """What knows where things were: `HomeFile`, and `HomeReader`."""

    def list_runs(self, keys: Sequence[str], *, is_single: bool) -> list[StoredSighting]:
        """See `list_runs`."""

    def list_near(self, keys: Sequence[str], begin: int, end: int) -> list[StoredSighting]:
        """See `list_near`."""


def list_runs(
    connection: sqlite3.Connection, keys: Sequence[str], *, is_single: bool
) -> list[StoredSighting]:
    """List where a thing was, one after the other, the latest first.

    Sightings that follow each other at one place are one, the last of them. Where a name is that of
    several things, which are seen at several places by turns, that is the last one at each place.
    What was said is all listed.

    Args:
        connection: of the file.
        keys: of the thing, and of what was merged with it (`things.key`).
        is_single: whether there is one of that name.
    """
    things, values = _find_things(keys)
    order = "(ORDER BY time, event, nth)"
    if not is_single:
        order = "(PARTITION BY place, relation, said IS NULL ORDER BY time, event, nth)"
    ends = (
        "following IS NULL OR said IS NOT NULL OR next_said IS NOT NULL OR next_place IS NOT place "
        "OR next_relation IS NOT relation"
    )
    found = connection.execute(
        f"SELECT {_COLUMNS} FROM (SELECT *, lead(time) OVER in_turn AS following, "
        "lead(place) OVER in_turn AS next_place, lead(relation) OVER in_turn AS next_relation, "
        "lead(said) OVER in_turn AS next_said "
        f"FROM sighting_rows WHERE thing IN {things} AND {_IS_THERE} WINDOW in_turn AS {order}) "
        f"WHERE {ends} ORDER BY time DESC, event DESC, nth DESC",
        values,
    )
    return [StoredSighting(*row) for row in found]


def list_near(
    connection: sqlite3.Connection, keys: Sequence[str], begin: int, end: int
) -> list[StoredSighting]:
    """Return the last of a thing before a time, the last in it, and the first after it.

    Args:
        connection: of the file.
        keys: as of `list_runs`.
        begin: first time step.
        end: last time step.
    """
    things, values = _find_things(keys)
    rows = []
    for bounds, order in (
        ((-1, begin - 1), "DESC"),
        ((begin, end), "DESC"),
        ((end + 1, 1 << 62), "ASC"),
    ):
        found = connection.execute(
            f"SELECT {_COLUMNS} FROM sighting_rows WHERE thing IN {things} "
            f"AND time BETWEEN ? AND ? AND {_IS_THERE} "
            f"ORDER BY time {order}, event {order}, nth {order} LIMIT 1",
            (*values, *bounds),
        ).fetchall()
        rows += [StoredSighting(*row) for row in found]
    return rows


def _find_things(keys: Sequence[str]) -> tuple[str, Sequence[str]]:
    """Return a query for the numbers of things, and its values."""
    asked = tuple(keys[:_MOST_KEYS])
    return f"(SELECT thing FROM things WHERE key IN ({','.join('?' * len(asked))}))", asked

"""The tables of a memory file, all in one place; docs/database.md explains them to people."""

from __future__ import annotations

import sqlite3
from collections import Counter

APPLICATION_ID = 0x53474D31  # "SGM1", in the head of the file: what `file home.sgm` may show
VERSION = 1  # `user_version` of the file

# The date of a time step, by the clock of the home; NULL without one.
_DATE = "datetime(clock_start, '+' || (step_seconds * {time}) || ' seconds')"

SCHEMA = (
    """CREATE TABLE home (
        prior TEXT NOT NULL,        -- checksum of the prior
        map TEXT NOT NULL,          -- id of the map; empty if none was given
        clock_start TEXT,           -- local date and time of step 0; NULL without a clock
        step_seconds REAL           -- length of a time step
    )""",
    """CREATE TABLE events (
        number INTEGER PRIMARY KEY, -- 1, 2, ... in the order in which they were made
        time INTEGER NOT NULL,      -- time step after it
        kind TEXT NOT NULL,         -- what was called: look, step, moved, furniture, ...
        arguments TEXT NOT NULL,    -- of that call, JSON
        by TEXT,                    -- who said so
        checksum INTEGER NOT NULL   -- CRC-32 of all these
    )""",
    """CREATE TABLE rooms (
        room INTEGER PRIMARY KEY,   -- its id
        label TEXT NOT NULL,        -- kitchen
        is_there INTEGER NOT NULL   -- 0 when it was removed
    )""",
    """CREATE TABLE places (
        place INTEGER PRIMARY KEY,  -- id of the furniture
        label TEXT NOT NULL,        -- fridge
        name TEXT NOT NULL,         -- white fridge
        room INTEGER NOT NULL REFERENCES rooms,
        x REAL, y REAL,             -- where one stands to look at it, else its middle; metres
        num_looks INTEGER NOT NULL, -- that are in this file
        last_look INTEGER,          -- time step of the latest
        is_there INTEGER NOT NULL   -- 0 when it was removed or merged with another one
    )""",
    """CREATE TABLE things (
        thing INTEGER PRIMARY KEY,
        key TEXT NOT NULL UNIQUE,   -- what tells it from others: an id of a tracker, or words;
                                    -- of what was forgotten, with its number
        name TEXT NOT NULL,         -- large red mug
        tracker TEXT NOT NULL,      -- its id; empty where words tell it from others
        same_as INTEGER REFERENCES things, -- the one that stands for it, where it was merged
        is_known INTEGER NOT NULL   -- 0 when it was forgotten
    )""",
    """CREATE TABLE sighting_rows (
        thing INTEGER NOT NULL REFERENCES things,
        time INTEGER NOT NULL,
        event INTEGER NOT NULL,     -- that says so; 0 or less of what a saved memory held then
        nth INTEGER NOT NULL,       -- of the event, from 0
        place INTEGER REFERENCES places, -- NULL with the robot
        relation TEXT,              -- in, onTop
        confidence REAL NOT NULL,
        x REAL, y REAL, z REAL,     -- where the thing was, in the map, metres
        said TEXT,                  -- moved, picked_up, put_down; NULL of what was seen
        by TEXT,                    -- who said so; NULL of what was seen
        PRIMARY KEY (thing, time, event, nth)
    ) WITHOUT ROWID""",
    f"""CREATE VIEW sightings AS
        SELECT things.name AS thing, places.name AS place, rooms.label AS room, relation,
            sighting_rows.x, sighting_rows.y, sighting_rows.z, confidence, time,
            {_DATE.format(time="time")} AS at, by, tracker, event
        FROM sighting_rows JOIN home JOIN things USING (thing)
            LEFT JOIN places USING (place) LEFT JOIN rooms USING (room)
        WHERE said IS NULL""",
    f"""CREATE VIEW statements AS
        SELECT by, said, things.name AS thing, places.name AS place, rooms.label AS room, relation,
            confidence, time, {_DATE.format(time="time")} AS at, event
        FROM sighting_rows JOIN home JOIN things USING (thing)
            LEFT JOIN places USING (place) LEFT JOIN rooms USING (room)
        WHERE said IS NOT NULL""",
    f"""CREATE VIEW moves AS
        SELECT things.name AS thing, old.name AS from_place, new.name AS to_place, relation, time,
            {_DATE.format(time="time")} AS at, by, event
        FROM (
            SELECT *, lag(coalesce(place, -1)) OVER of_thing AS before
            FROM sighting_rows WHERE confidence >= 0.5
            WINDOW of_thing AS (PARTITION BY thing ORDER BY time, event, nth)
        ) AS seen JOIN home JOIN things USING (thing)
            LEFT JOIN places AS new ON new.place = seen.place
            LEFT JOIN places AS old ON old.place = seen.before
        WHERE before <> coalesce(seen.place, -1)""",
    """CREATE TABLE snapshots (
        event INTEGER PRIMARY KEY,  -- the last one that is in it
        time INTEGER NOT NULL,
        bytes INTEGER NOT NULL,     -- of arguments of all events until then
        content TEXT NOT NULL,      -- all that are no numbers of its tables, JSON
        checksum TEXT NOT NULL      -- SHA-256 of content and arrays
    )""",
    """CREATE TABLE snapshot_arrays (
        event INTEGER NOT NULL REFERENCES snapshots,
        name TEXT NOT NULL,         -- table and column
        type TEXT NOT NULL,         -- i1, i2, i4, i8, f4 or f8, little-endian
        numbers BLOB NOT NULL,
        PRIMARY KEY (event, name)
    )""",
    """CREATE TABLE answers (
        key TEXT PRIMARY KEY,       -- of a write that may be sent again
        event INTEGER NOT NULL,     -- the last one that it made
        about TEXT NOT NULL,        -- SHA-256 of what was sent
        answer TEXT NOT NULL        -- JSON
    )""",
)

# What Litestream, which replicates a file to another disk, keeps in it for itself (docs/scale.md).
REPLICATION = (
    "CREATE TABLE _litestream_seq (id INTEGER PRIMARY KEY, seq INTEGER)",
    "CREATE TABLE _litestream_lock (id INTEGER)",
)


def make_tables(connection: sqlite3.Connection) -> None:
    """Make the empty tables of a new file."""
    for statement in SCHEMA:
        connection.execute(statement)
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.execute(f"PRAGMA user_version = {VERSION}")


def find_fault(connection: sqlite3.Connection) -> str:
    """Say what tells a file from one of ours; empty if nothing does.

    The text of every table is compared, so that no trigger, view, function or rule in a file that
    comes from anyone is ever used. Those of `REPLICATION` may be there, and are not read.
    """
    (number,) = connection.execute("PRAGMA application_id").fetchone()
    if number != APPLICATION_ID:
        return "a database of another program"
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != VERSION:
        return f"version {version}"
    found = connection.execute(
        "SELECT substr(sql, 1, 10000) FROM sqlite_master WHERE sql IS NOT NULL LIMIT 100"
    )
    texts = Counter(text for (text,) in found)  # some may be of another type
    if texts - Counter(REPLICATION) != Counter(SCHEMA):
        return "other tables"
    return ""

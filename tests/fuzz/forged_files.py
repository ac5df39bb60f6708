"""Memory files as anyone could have changed them: their bytes, or what they say, with checksums."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import mutate
import numpy as np

from sgm.store.event import StoredEvent, insert_event
from sgm.store.home_reader import HomeReader
from sgm.store.snapshot import write_snapshot

Rng = np.random.Generator
_TIMES = (10**3, 10**6, 3 * 10**9, 2**53, 2**63 - 1, 10**30, -1)
# What another program may do to a file.
_STATEMENTS = (
    "DELETE FROM snapshots",
    "DELETE FROM snapshot_arrays",
    "DELETE FROM events WHERE number % 2 = 0",
    "UPDATE events SET kind = 'dance'",
    "UPDATE events SET arguments = zeroblob(1000000)",
    "UPDATE snapshots SET content = ?",
    "CREATE TABLE more (a INTEGER)",
    "CREATE TRIGGER more AFTER INSERT ON events BEGIN DELETE FROM events; END",
    "DROP TABLE rooms",
    "PRAGMA application_id = 7",
    "PRAGMA user_version = 2",
    "UPDATE things SET name = NULL",
)


def change_file(path: Path, rng: Rng) -> None:
    """Change a memory file in one way."""
    kind = rng.random()
    if kind < 0.3:
        _disorder(path, rng)
    elif kind < 0.5:
        path.write_bytes(mutate.mutate_bytes(path.read_bytes(), rng))
    elif kind < 0.6:
        _run(path, str(rng.choice(_STATEMENTS)))
    else:
        _forge(path, rng)


def _run(path: Path, statement: str) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        try:
            connection.execute(statement, ("{}",) * statement.count("?"))
        except sqlite3.Error:  # a rule of the table
            return


def _disorder(path: Path, rng: Rng) -> None:
    """Let events say odd times, be there twice, or be gone."""
    with HomeReader(path) as reader:
        _, rows = reader.read(from_first=True)
    for _ in range(int(rng.integers(1, 4))):
        at, kind = int(rng.integers(len(rows) or 1)), rng.integers(4)
        number = int(_TIMES[int(rng.integers(len(_TIMES)))])
        kept = max(min(number, 2**63 - 1), -(2**63))  # what a column of SQLite holds
        if kind == 0 or not rows:
            rows.append(StoredEvent(0, kept, "step", json.dumps({"num_steps": number}), None))
        elif kind == 1:
            rows[at] = rows[at]._replace(time=kept)
        elif kind == 2:
            rows.insert(int(rng.integers(len(rows))), rows[at])
        else:
            del rows[at]
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("DELETE FROM snapshots WHERE event > 0")
        connection.execute("DELETE FROM events")
        for place, row in enumerate(rows, 1):
            insert_event(connection, row._replace(number=place))


def _forge(path: Path, rng: Rng) -> None:
    """Change a snapshot, or an event, and what it states of itself."""
    with HomeReader(path) as reader:
        snapshot, rows = reader.read(from_first=True)
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("DELETE FROM snapshots WHERE event > ?", (snapshot.event,))
        if rows and rng.random() < 0.5:
            number = int(rng.integers(len(rows)))
            changed = mutate.mutate_json(json.loads(rows[number].arguments), rng)
            row = rows[number]._replace(arguments=json.dumps(changed))
            connection.execute("DELETE FROM events WHERE number = ?", (row.number,))
            insert_event(connection, row)
            return
        arrays = dict(snapshot.arrays)
        name = str(rng.choice(sorted(arrays)))
        if rng.random() < 0.3 and len(arrays[name]):
            column = arrays[name].copy()
            column[int(rng.integers(len(column)))] = rng.choice([-2, 0, 7, 2**31, -(2**62)])
            arrays[name] = column
            snapshot = replace(snapshot, arrays=arrays)
        else:
            snapshot = replace(snapshot, values=mutate.mutate_json(snapshot.values, rng))
        write_snapshot(connection, snapshot)

"""All that a memory holds at one moment, in a file: JSON, and columns of numbers as blobs."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.files import parse_json
from sgm.messages import shorten

_WHOLE = ("i1", "i2", "i4", "i8")
_TYPES = (*_WHOLE, "f4", "f8")

Arrays = Mapping[str, np.ndarray]  # int64 or float64 (rows,) by name


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a memory holds.

    Attributes:
        event: number of the last event that is in it.
        time: time step.
        values: JSON values.
        arrays: columns by name.
    """

    event: int
    time: int
    values: dict[str, Any]
    arrays: Arrays


def write_snapshot(connection: sqlite3.Connection, snapshot: Snapshot, num_bytes: int = 0) -> None:
    """Write a snapshot into a transaction; one of the same event is replaced.

    `num_bytes` is how much all events until then take.
    """
    content = json.dumps(snapshot.values, ensure_ascii=False, separators=(",", ":"))
    rows = [(snapshot.event, name, *_pack(column)) for name, column in snapshot.arrays.items()]
    delete_snapshot(connection, snapshot.event)
    connection.execute(
        "INSERT INTO snapshots VALUES (?, ?, ?, ?, ?)",
        (snapshot.event, snapshot.time, num_bytes, content, _compute_checksum(content, rows)),
    )
    connection.executemany("INSERT INTO snapshot_arrays VALUES (?, ?, ?, ?)", rows)


def delete_snapshot(connection: sqlite3.Connection, event: int) -> None:
    """Remove the snapshot of an event, if there is one."""
    connection.execute("DELETE FROM snapshot_arrays WHERE event = ?", (event,))
    connection.execute("DELETE FROM snapshots WHERE event = ?", (event,))


def list_snapshots(connection: sqlite3.Connection) -> list[tuple[int, int, int]]:
    """Return event, time step and bytes of the snapshots, the earliest first."""
    return connection.execute(
        "SELECT event, time, bytes FROM snapshots ORDER BY event LIMIT 10"
    ).fetchall()


def read_snapshot(connection: sqlite3.Connection, event: int) -> Snapshot:
    """Read the snapshot of an event.

    Raises:
        ValueError: if there is none, or it is not as it was written.
    """
    found = connection.execute(
        "SELECT time, content, checksum FROM snapshots WHERE event = ?", (event,)
    ).fetchone()
    if found is None:
        raise ValueError("no snapshot")
    time, content, checksum = found
    rows = connection.execute(
        "SELECT event, name, type, numbers FROM snapshot_arrays WHERE event = ? ORDER BY rowid",
        (event,),
    ).fetchall()
    if not isinstance(content, str) or not all(isinstance(row[-1], bytes) for row in rows):
        raise ValueError("other types of values")
    if checksum != _compute_checksum(content, rows):
        raise ValueError("another checksum than the one it states")
    arrays = {name: _unpack(kind, numbers) for _, name, kind, numbers in rows}
    return Snapshot(event, time, parse_json(content, allow_nan=True), arrays)


def _compute_checksum(content: str, rows: Any) -> str:
    checksum = hashlib.sha256(content.encode("utf-8", "surrogatepass"))
    for _, name, kind, numbers in rows:
        checksum.update(f"\n{name} {kind} {len(numbers)}\n".encode())
        checksum.update(numbers)
    return checksum.hexdigest()


def _pack(column: np.ndarray) -> tuple[str, bytes]:
    """Return a type that holds all numbers of a column, and these."""
    kind = "f4" if np.array_equal(column, column.astype(np.float32), equal_nan=True) else "f8"
    if column.dtype.kind == "i":
        low, high = (int(column.min()), int(column.max())) if len(column) else (0, 0)
        limits = (np.iinfo(name) for name in _WHOLE)
        kind = next(
            name
            for name, limit in zip(_WHOLE, limits, strict=True)
            if limit.min <= low and high <= limit.max
        )
    return kind, column.astype(f"<{kind}").tobytes()


def _unpack(kind: str, numbers: bytes) -> np.ndarray:
    if kind not in _TYPES:
        raise ValueError(f"numbers of type {shorten(kind)}")
    column = np.frombuffer(numbers, f"<{kind}")
    return column.astype(np.float64 if kind[0] == "f" else np.int64)

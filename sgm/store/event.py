"""What was called, as a row of a memory file."""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from sgm.messages import shorten

_ENCODER = json.JSONEncoder(
    ensure_ascii=False,
    separators=(",", ":"),
    # Boxes and viewpoints; or numbers of numpy, as ids and positions may be.
    default=lambda value: value.to_json() if hasattr(value, "to_json") else value.item(),
)


class StoredEvent(NamedTuple):
    """One change of a memory.

    Attributes:
        number: 1, 2, ... of the file.
        time: time step of the memory after it.
        kind: what was called.
        arguments: JSON.
        by: who said so.
    """

    number: int
    time: int
    kind: str
    arguments: str
    by: str | None

    def compute_checksum(self) -> int:
        """Return the CRC-32 of all columns."""
        text = f"{self.number}\n{self.time}\n{self.kind}\n{self.arguments}\n{self.by}"
        return zlib.crc32(text.encode("utf-8", "surrogatepass"))


_COLUMNS = f"{', '.join(StoredEvent._fields)}, checksum"


def write_arguments(values: Mapping[str, Any]) -> str:
    """Return arguments as JSON."""
    return _ENCODER.encode(values)


def insert_event(connection: sqlite3.Connection, row: StoredEvent) -> None:
    """Write an event; sqlite3.IntegrityError if another one of its number is there."""
    values = (*row, row.compute_checksum())
    connection.execute(f"INSERT INTO events ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?)", values)


def read_rows(connection: sqlite3.Connection, after: int) -> list[StoredEvent]:
    """Read the events after a number, in order.

    Raises:
        ValueError: if one is missing, or is not as it was written.
    """
    rows, expected = [], after
    found = connection.execute(
        f"SELECT {_COLUMNS} FROM events WHERE number > ? ORDER BY number", (after,)
    )
    for *values, checksum in found:
        row, expected = StoredEvent(*values), expected + 1
        if row.number != expected or row.compute_checksum() != checksum:
            raise ValueError(f"no event {expected} as it was written, but {shorten(row.number)}")
        rows.append(row)
    return rows

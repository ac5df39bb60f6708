"""What a server and its process for reading send each other: a head, then bytes."""

from __future__ import annotations

import asyncio
import struct
from enum import IntEnum

_HEAD = struct.Struct("<BQI")  # what it is, number of the question, bytes that follow


class Kind(IntEnum):
    """What is sent."""

    QUESTION = 1  # JSON: name of the call, and its arguments
    READY = 2  # the file was read
    ANSWER = 3  # processor seconds of the process so far, then JSON
    ERROR = 4  # the call has raised something: who asked calls itself, and gets the same


def pack(frame_kind: Kind, number: int, body: bytes = b"") -> bytes:
    """Return what is sent."""
    return _HEAD.pack(frame_kind, number, len(body)) + body


async def read_frame(stream: asyncio.StreamReader) -> tuple[Kind, int, bytes]:
    """Read what was sent; raises IncompleteReadError where the other one has ended."""
    frame_kind, number, size = _HEAD.unpack(await stream.readexactly(_HEAD.size))
    return Kind(frame_kind), number, await stream.readexactly(size)

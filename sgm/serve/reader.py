"""A second process that reads the memory file, and answers what only reads."""

from __future__ import annotations

import asyncio
import json
import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from enum import IntEnum
from pathlib import Path
from typing import Any

SECONDS = struct.Struct("<d")
HEAD = struct.Struct("<BQI")  # what it is, number of the question, bytes that follow


class Kind(IntEnum):
    """What is sent."""

    QUESTION = 1  # JSON: name of the call, and its arguments
    READY = 2  # the file was read
    ANSWER = 3  # processor seconds of the process so far, then JSON
    ERROR = 4  # the call has raised something: who asked calls itself, and gets the same


def pack(frame_kind: Kind, number: int, body: bytes = b"") -> bytes:
    """Return what is sent."""
    return HEAD.pack(frame_kind, number, len(body)) + body


async def read_frame(stream: asyncio.StreamReader) -> tuple[Kind, int, bytes]:
    """Read what was sent; raises IncompleteReadError where the other one has ended."""
    frame_kind, number, size = HEAD.unpack(await stream.readexactly(HEAD.size))
    return Kind(frame_kind), number, await stream.readexactly(size)


class ReaderFailed(Exception):
    """The process did not answer: who asks is to call by itself."""


class Reader:
    """Asks a process that reads a memory file beside the one that writes it.

    One interpreter runs one thread at a time, so that reading beside reading takes two. A write is
    in the file before it is answered, and the process reads what is new before each question: so an
    answer knows all that was answered before.

    Attributes:
        is_ready: whether it has read the file.
        processor_seconds: of the process.
        num_waiting: questions that are not answered yet.
    """

    def __init__(self, arguments: Sequence[str], tell: Callable[[str], None]) -> None:
        """Have a process of `sgm.serve.read_process` with some arguments.

        `tell` gets a line if it ends too early.
        """
        self._arguments, self._tell = list(arguments), tell
        self._process: asyncio.subprocess.Process | None = None
        self._listening: asyncio.Task[None] | None = None
        self._waiting: dict[int, asyncio.Future[bytes]] = {}
        self._number = 0
        self._is_closing = False
        self.is_ready = False
        self.processor_seconds = 0.0

    @property
    def num_waiting(self) -> int:
        """Questions that are not answered yet."""
        return len(self._waiting)

    async def start(self, path: Path) -> None:
        """Begin the process, and have it read a memory file."""
        # The modules of this process, whatever the folder is: `-m` would look there first.
        code = (
            f"import sys; sys.path[:] = {sys.path!r}; "
            "from sgm.serve.read_process import main; sys.exit(main(sys.argv[1:]))"
        )
        process = self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-c",
            code,
            str(path),
            *self._arguments,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
        )
        assert process.stdout is not None
        self._listening = asyncio.create_task(self._listen(process.stdout))

    async def ask(self, name: str, arguments: Mapping[str, Any], seconds: float) -> bytes:
        """Return the answer of a call that only reads, as JSON.

        Args:
            name: of the call.
            arguments: those of `Call.read`.
            seconds: most that it may take.

        Raises:
            ReaderFailed: if there is no answer.
            asyncio.TimeoutError: if it takes too long.
        """
        if not self.is_ready:
            raise ReaderFailed
        self._number += 1
        number = self._number
        ended = self._waiting[number] = asyncio.get_running_loop().create_future()
        self._send(pack(Kind.QUESTION, number, _write_question(name, arguments)))
        try:
            return await asyncio.wait_for(ended, seconds)
        finally:
            self._waiting.pop(number, None)

    async def close(self) -> None:
        """End the process, which has nothing to lose."""
        self._is_closing, self.is_ready = True, False
        process = self._process
        if process is None:
            return
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if self._listening is not None:
            await self._listening

    def _send(self, frame: bytes) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        if not self._process.stdin.is_closing():
            self._process.stdin.write(frame)

    async def _listen(self, stream: asyncio.StreamReader) -> None:
        """Hand out answers until the process ends."""
        with suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                frame_kind, number, body = await read_frame(stream)
                if frame_kind == Kind.READY:
                    self.is_ready = True
                    continue
                ended = self._waiting.get(number)
                if ended is None or ended.done():  # no one waits for it any longer
                    continue
                if frame_kind == Kind.ERROR:
                    ended.set_exception(ReaderFailed())
                else:
                    (self.processor_seconds,) = SECONDS.unpack_from(body)
                    ended.set_result(body[SECONDS.size :])
        self.is_ready = False
        for ended in self._waiting.values():
            if not ended.done():
                ended.set_exception(ReaderFailed())
        if not self._is_closing:
            self._tell("the process that answers what only reads has ended: this one does so now")


def _write_question(name: str, arguments: Mapping[str, Any]) -> bytes:
    def write_time(value: datetime) -> str:
        return value.isoformat()

    return json.dumps([name, dict(arguments)], default=write_time).encode()

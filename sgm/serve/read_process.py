"""The process behind `sgm.serve.reader`: it reads along what another one writes, and is asked."""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Lock

from sgm.finder.answers import write_json
from sgm.finder.read_calls import ReadCalls
from sgm.names.sections import ENGLISH
from sgm.replay.followed_memory import FollowedMemory
from sgm.serve.caller import NUM_READERS, Turns
from sgm.serve.calls import BY_NAME
from sgm.serve.finders import make_finder, warm_up
from sgm.serve.reader import SECONDS, Kind, pack, read_frame


class ReadProcess:
    """Answers questions about what a memory file holds.

    Questions take turns in threads, as in the server itself; before each, what was written since is
    read.
    """

    def __init__(self, followed: FollowedMemory, reads: ReadCalls, timeout: float) -> None:
        """Answer from a memory that is read along; none waits longer than `timeout` seconds."""
        self._followed, self._reads, self._timeout = followed, reads, timeout
        self._turns, self._pool = Turns(), ThreadPoolExecutor(NUM_READERS, "sgm-read")
        self._catching_up = Lock()
        self._answering: set[asyncio.Task[None]] = set()

    async def run(self, stream: asyncio.StreamReader, output: asyncio.WriteTransport) -> None:
        """Answer until the input ends."""
        warm_up(self._reads.finder, self._reads.memory)
        output.write(pack(Kind.READY, 0))
        while True:
            try:
                _, number, body = await read_frame(stream)
            except asyncio.IncompleteReadError:
                break
            task = asyncio.create_task(self._answer(number, body, output))
            self._answering.add(task)
            task.add_done_callback(self._answering.discard)
        self._pool.shutdown(wait=False, cancel_futures=True)

    async def _answer(self, number: int, body: bytes, output: asyncio.WriteTransport) -> None:
        try:
            answer = await self._turns.run(self._pool, partial(self._call, body), self._timeout)
        except Exception:  # who asked makes the call itself, and has the same one
            output.write(pack(Kind.ERROR, number))
            return
        seconds = SECONDS.pack(time.process_time())
        output.write(pack(Kind.ANSWER, number, seconds + answer))

    def _call(self, body: bytes) -> bytes:
        with self._catching_up:
            self._followed.catch_up()
        name, values = json.loads(body)
        call = BY_NAME[name]
        return write_json(call.run(self._reads, call.read(values)))


def main(argv: list[str]) -> int:
    """Run the process, on standard input and output, until the input ends."""
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("home", type=Path)
    parser.add_argument("--finder", required=True)
    parser.add_argument("--aliases", type=Path)
    parser.add_argument("--language", default=ENGLISH)
    parser.add_argument("--timeout", type=float, required=True)
    options = parser.parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the server, and that this one
    warnings.simplefilter("ignore")  # the server has told them
    asyncio.run(_run(options))
    return 0


async def _run(options: argparse.Namespace) -> None:
    loop, stream = asyncio.get_running_loop(), asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(stream), sys.stdin.buffer)
    output, _ = await loop.connect_write_pipe(asyncio.BaseProtocol, sys.stdout.buffer)
    followed = FollowedMemory(options.home, options.aliases, options.language)
    reads = ReadCalls(followed.memory, make_finder(options.finder))
    await ReadProcess(followed, reads, options.timeout).run(stream, output)

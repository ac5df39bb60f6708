"""The process behind `sgm.serve.reader`: it reads along what another one writes, and is asked."""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
import warnings
from pathlib import Path
from queue import SimpleQueue
from threading import Condition, Lock, Thread, get_ident
from typing import BinaryIO

from sgm.finder.answers import write_json
from sgm.finder.read_calls import ReadCalls
from sgm.names.sections import ENGLISH
from sgm.replay.followed_memory import FollowedMemory
from sgm.serve.caller import NUM_READERS, TURN_SECONDS
from sgm.serve.calls import BY_NAME
from sgm.serve.finders import make_finder, warm_up
from sgm.serve.reader import HEAD, SECONDS, Kind, pack


class ReadProcess:
    """Answers questions about what a memory file holds.

    Questions take turns in threads, as in `sgm.serve.caller.Turns`; before each, what was written
    since is read. No event loop waits beside them for the interpreter.
    """

    def __init__(
        self, followed: FollowedMemory, reads: ReadCalls, timeout: float, output: BinaryIO
    ) -> None:
        """Answer to `output` from a memory that is read along.

        Questions that have waited longer than `timeout` seconds are left out.
        """
        self._followed, self._reads, self._timeout = followed, reads, timeout
        self._output, self._writing, self._catching_up = output, Lock(), Lock()
        self._questions: SimpleQueue[tuple[float, int, bytes]] = SimpleQueue()
        self._ended, self._first = Condition(), 0  # the thread whose turn it is; 0 for none

    def run(self, stream: BinaryIO) -> None:
        """Answer until the input ends."""
        warm_up(self._reads.finder, self._reads.memory)
        for _ in range(NUM_READERS):
            Thread(target=self._work, name="sgm-read", daemon=True).start()
        self._write(pack(Kind.READY, 0))
        while len(head := stream.read(HEAD.size)) == HEAD.size:
            _, number, size = HEAD.unpack(head)
            self._questions.put((time.monotonic(), number, stream.read(size)))

    def _work(self) -> None:
        """Answer one question after the other; in a thread."""
        while True:
            came, number, body = self._questions.get()
            self._begin_turn()
            try:
                if time.monotonic() - came > self._timeout:
                    continue
                answer = self._call(body)
            except Exception:  # who asked makes the call itself, and has the same one
                self._write(pack(Kind.ERROR, number))
            else:
                seconds = SECONDS.pack(time.process_time())
                self._write(pack(Kind.ANSWER, number, seconds + answer))
            finally:
                self._end_turn()

    def _begin_turn(self) -> None:
        """Wait until the one before has ended, or has taken too long."""
        with self._ended:
            self._ended.wait_for(lambda: not self._first, TURN_SECONDS)
            self._first = get_ident()

    def _end_turn(self) -> None:
        with self._ended:
            if self._first == get_ident():
                self._first = 0
                self._ended.notify()

    def _call(self, body: bytes) -> bytes:
        with self._catching_up:
            self._followed.catch_up()
        name, values = json.loads(body)
        call = BY_NAME[name]
        return write_json(call.run(self._reads, call.read(values)))

    def _write(self, frame: bytes) -> None:
        with self._writing:
            self._output.write(frame)
            self._output.flush()


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
    followed = FollowedMemory(options.home, options.aliases, options.language)
    reads = ReadCalls(followed.memory, make_finder(options.finder))
    ReadProcess(followed, reads, options.timeout, sys.stdout.buffer).run(sys.stdin.buffer)
    return 0

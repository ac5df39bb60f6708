"""Makes calls in threads that take turns, each within its time, and keeps what they write."""

from __future__ import annotations

import asyncio
import sys
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
from typing import Any

from sgm.finder.answers import write_json
from sgm.finder.service import MemoryService
from sgm.serve.calls import Call
from sgm.serve.guard import Refused
from sgm.serve.reader import Reader, ReaderFailed

NUM_READERS = 4
MOST_WAITING = 200  # calls at once; more are refused
DEFAULT_TIMEOUT = 10.0  # seconds for a call
SYNC_SECONDS = 1.0
MOST_QUEUED = 16  # questions at the reader, from which on this process answers some, too
TURN_SECONDS = 0.05  # after which the next function begins beside one that is not done


class Turns:
    """Runs functions in threads, one after the other in the order in which they came.

    One thread of Python runs at a time. Where several compute at once, an event loop waits for all
    of them whenever it has read or written a byte, and its requests wait with it. So a function
    begins when the one before has ended and the loop has seen to its connections. One that takes
    longer than `TURN_SECONDS` passes its turn on, and ends beside the next ones.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[asyncio.Future[Any], Executor, Callable[[], Any]]] = deque()
        self._first: asyncio.Future[Any] | None = None  # whose turn it is
        self._num_running = 0

    def __len__(self) -> int:
        """How many wait or run, with those whose callers wait no longer."""
        return len(self._waiting) + self._num_running

    async def run(self, pool: Executor, function: Callable[[], Any], seconds: float) -> Any:
        """Run a function in a thread of a pool when it is its turn, and return what it returns.

        Raises:
            asyncio.TimeoutError: if it has not ended within some seconds. It is left out if it has
                not begun; else it goes on.
        """
        loop = asyncio.get_running_loop()
        ended: asyncio.Future[Any] = loop.create_future()
        timer = loop.call_later(seconds, _end, ended, None, asyncio.TimeoutError())
        self._waiting.append((ended, pool, function))
        if self._first is None:
            self._begin()
        try:
            return await ended
        finally:
            timer.cancel()

    def _begin(self) -> None:
        """Let the one have its turn that has waited for longest."""
        self._first = None
        while self._waiting and self._first is None:
            ended, pool, function = self._waiting.popleft()
            if not ended.done():
                self._first = ended
                self._num_running += 1
                loop = ended.get_loop()
                timer = loop.call_later(TURN_SECONDS, self._pass_on, ended)
                pool.submit(self._work, ended, function, timer)

    def _work(
        self, ended: asyncio.Future[Any], function: Callable[[], Any], timer: asyncio.TimerHandle
    ) -> None:
        """Run a function; in a thread."""
        result, error = None, None
        try:
            result = function()
        except BaseException as caught:
            error = caught
        ended.get_loop().call_soon_threadsafe(self._note_end, ended, timer, result, error)

    def _note_end(
        self,
        ended: asyncio.Future[Any],
        timer: asyncio.TimerHandle,
        result: Any,
        error: BaseException | None,
    ) -> None:
        timer.cancel()
        self._num_running -= 1
        # Later: after the answer was sent, and what has come by then was read.
        ended.get_loop().call_later(0, self._pass_on, ended)
        _end(ended, result, error)

    def _pass_on(self, ended: asyncio.Future[Any]) -> None:
        if self._first is ended:
            self._begin()


def _end(ended: asyncio.Future[Any], result: Any, error: BaseException | None) -> None:
    if ended.done():  # no client waits for it any longer
        return
    if error is None:
        ended.set_result(result)
    else:
        ended.set_exception(error)


class Caller:
    """Makes the calls of a service, and keeps its memory on disk.

    Calls take turns (`Turns`), and none waits for the disk but those that write. Writes are made by
    one thread. A change is committed to the memory file before its call is answered; when the disk
    has it, `sync` says: "answer" before the call is answered, "second" within a second, "never"
    when the system likes. What only reads is answered by a process of its own, where there is one
    (`Reader`), and by this one, too, while it has nothing to do and that one has too much.
    """

    def __init__(
        self,
        service: MemoryService,
        sync: str = "second",
        timeout: float = DEFAULT_TIMEOUT,
        reader: Reader | None = None,
    ) -> None:
        """Make calls of a service, each within seconds; its memory may be kept in a file."""
        self.service = service
        self.reader = reader
        self.timeout = timeout
        self._sync = sync
        self._readers = ThreadPoolExecutor(NUM_READERS, "sgm-read")
        self._writer = ThreadPoolExecutor(1, "sgm-write")
        self._turns = Turns()
        self._syncing = asyncio.Lock()
        self.num_writes = 0
        self._num_synced = 0
        self._told = ""  # the latest warning

    async def call(self, call: Call, arguments: Mapping[str, Any]) -> Any:
        """Make a call with arguments of `Call.read`, and return its answer.

        Raises:
            Refused: if too many calls wait, or it takes too long. A write that takes too long may
                still be made: sent again with its key, it is made once.
            KeyError, ValueError: as the method does.
            OSError: if the disk does not take a write; then it was not made, or, where the disk was
                to have it before the answer, may be lost with the power.
        """
        self._check_waiting()
        run = partial(call.run, self.service, arguments)
        pool = self._readers
        if call.is_write:
            run, pool = partial(self._write, run), self._writer
        try:
            answer = await self._turns.run(pool, run, self.timeout)
            if call.is_write and self._sync == "answer":
                await asyncio.wait_for(self._sync_file(), self.timeout)
        except asyncio.TimeoutError:
            raise self._refuse_slow(call.is_write) from None
        return answer

    async def answer(self, call: Call, arguments: Mapping[str, Any]) -> bytes:
        """Make a call as `call` does, and return its answer as it is sent."""
        if self.reader is not None and call.only_reads:
            self._check_waiting()
            if self.reader.num_waiting >= MOST_QUEUED and not self._turns:
                return write_json(await self.call(call, arguments))
            try:
                return await self.reader.ask(call.name, arguments, self.timeout)
            except ReaderFailed:  # or not ready: this process has the same answer, or error
                pass
            except asyncio.TimeoutError:
                raise self._refuse_slow() from None
        return write_json(await self.call(call, arguments))

    async def start_reader(self) -> None:
        """Begin the process that answers what only reads, if there is to be one."""
        path = self.service.memory.path
        if self.reader is not None and path is not None:
            await self._try(self.reader.start(path))

    async def close_reader(self) -> None:
        """End that process."""
        if self.reader is not None:
            await self.reader.close()

    def _check_waiting(self) -> None:
        num_waiting = len(self._turns) + (0 if self.reader is None else self.reader.num_waiting)
        if num_waiting >= MOST_WAITING:
            line = f"calls must be at most {MOST_WAITING} at once, got more. Nothing was done. "
            raise Refused(503, f"{line}Wait, and send it again.")

    def _refuse_slow(self, is_write: bool = False) -> Refused:
        line = f"a call must take at most {self.timeout:g} s, got a longer one. "
        line += (
            "It may have been made, or be made yet: send it again with the same key, and it is "
            "made once. Without a key, see first what is known."
            if is_write
            else "Try again."
        )
        return Refused(503, line)

    def _write(self, run: Callable[[], Any]) -> Any:
        answer = run()
        self.num_writes += 1
        return answer

    async def _sync_file(self) -> None:
        """Have the disk take all writes: those made during one sync go together with the next."""
        made = self.num_writes
        async with self._syncing:
            if self._num_synced < made:
                made = self.num_writes
                await asyncio.to_thread(self.service.memory.sync)
                self._num_synced = made

    async def keep(self, snapshot_seconds: float) -> None:
        """Let time pass, write to the disk and take snapshots, until it is cancelled.

        Snapshots are written some seconds apart, while there is something new.
        """
        loop = asyncio.get_running_loop()
        saved_at = loop.time()
        while True:
            await asyncio.sleep(SYNC_SECONDS)
            await self._try(self._turns.run(self._writer, self._let_time_pass, self.timeout))
            if self._sync == "second":
                await self._try(self._sync_file())
            await self._try(asyncio.to_thread(self.service.memory.parts.files.checkpoint))
            if loop.time() - saved_at >= snapshot_seconds:
                saved_at = loop.time()
                await self._try(asyncio.to_thread(self.save))

    async def _try(self, doing: Awaitable[object]) -> None:
        """Wait until something is done; what goes wrong is reported, and tried again later."""
        try:
            await doing
        except (OSError, ValueError, asyncio.TimeoutError) as error:
            if str(error) != self._told:
                self._told = str(error)
                print(f"warning: {error}", file=sys.stderr, flush=True)

    def save(self) -> None:
        """Write a snapshot, if there is anything new; raises OSError, and then the events stay."""
        file = self.service.memory.parts.files.file
        if file is not None and file.num_new:
            self.service.memory.save(file.path)

    def close(self) -> None:
        """Wait for the calls that were begun, and let go of the file."""
        for pool in (self._readers, self._writer):
            pool.shutdown(wait=True)
        self.service.memory.close()

    def _let_time_pass(self) -> None:
        if self.service.let_time_pass():
            self.num_writes += 1

"""Makes calls in threads, one at a time and each within its time, and keeps what they write."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from sgm.finder.service import MemoryService
from sgm.memory.kept_home import KeptHome
from sgm.serve.calls import Call
from sgm.serve.guard import Refused
from sgm.serve.turns import Turns

NUM_READERS = 4
MOST_WAITING = 200  # calls at once; more are refused
DEFAULT_TIMEOUT = 10.0  # seconds for a call
SYNC_SECONDS = 1.0


class Caller:
    """Makes the calls of a service, and keeps its memory on disk.

    Calls take turns (`Turns`), and none waits for the disk but those that write. Writes are made by
    one thread. A line of the log has left the process before its call is answered; when the disk
    has it, `sync` says: "answer" before the call is answered, "second" within a second, "never"
    when the system likes.
    """

    def __init__(
        self,
        service: MemoryService,
        home: KeptHome | None = None,
        sync: str = "second",
        timeout: float = DEFAULT_TIMEOUT,
    ) -> None:
        """Make calls of a service, each within seconds; `home` is where its memory is kept."""
        self.service = service
        self.home = home
        self.timeout = timeout
        self._sync = sync
        self._readers = ThreadPoolExecutor(NUM_READERS, "sgm-read")
        self._writer = ThreadPoolExecutor(1, "sgm-write")
        self._turns = Turns()
        self._syncing = asyncio.Lock()
        self.num_writes = 0
        self._num_synced = self._num_saved = 0
        self._told = ""  # the latest warning

    async def call(self, call: Call, arguments: Mapping[str, Any]) -> Any:
        """Make a call with arguments of `Call.read`, and return its answer.

        Raises:
            Refused: if too many calls wait, or it takes too long. A write that takes too long may
                still be made.
            KeyError, ValueError: as the method does.
            OSError: if the disk does not take a write; then it was not made, or, where the disk was
                to have it before the answer, may be lost with the power.
        """
        if len(self._turns) >= MOST_WAITING:
            raise Refused(503, f"calls must be at most {MOST_WAITING} at once, got more. Wait.")
        run = partial(call.run, self.service, arguments)
        pool = self._readers
        if call.is_write:
            run, pool = partial(self._write, run), self._writer
        try:
            answer = await self._turns.run(pool, run, self.timeout)
            if call.is_write and self._sync == "answer":
                await asyncio.wait_for(self._sync_log(), self.timeout)
        except asyncio.TimeoutError:
            raise Refused(
                503, f"a call must take at most {self.timeout:g} s, got a longer one. Try again."
            ) from None
        return answer

    def _write(self, run: Callable[[], Any]) -> Any:
        answer = run()
        self.num_writes += 1
        return answer

    async def _sync_log(self) -> None:
        """Have the disk take all writes: those made during one sync go together with the next."""
        made = self.num_writes
        async with self._syncing:
            if self._num_synced < made:
                made = self.num_writes
                await asyncio.to_thread(self.service.memory.sync_log)
                self._num_synced = made

    async def keep(self, snapshot_seconds: float) -> None:
        """Let time pass, write to the disk and begin logs anew, until it is cancelled.

        Snapshots are written some seconds apart, while there is something new.
        """
        loop = asyncio.get_running_loop()
        saved_at = loop.time()
        while True:
            await asyncio.sleep(SYNC_SECONDS)
            await self._try(self._turns.run(self._writer, self._let_time_pass, self.timeout))
            if self._sync == "second":
                await self._try(self._sync_log())
            is_due = loop.time() - saved_at >= snapshot_seconds
            if self.home is not None and self.num_writes > self._num_saved:
                if is_due or self.home.is_log_long:
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
        """Write a snapshot, if there is anything new; raises OSError, and then the log has all."""
        if self.home is not None and self.num_writes > self._num_saved:
            self._num_saved = self.num_writes
            self.home.snapshot()

    def close(self) -> None:
        """Wait for the calls that were begun, and `save`."""
        for pool in (self._readers, self._writer):
            pool.shutdown(wait=True)
        self.save()

    def _let_time_pass(self) -> None:
        if self.service.let_time_pass():
            self.num_writes += 1

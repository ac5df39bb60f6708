"""Makes calls in threads: those that only read beside one that writes, each within its time."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any

from sgm.finder.service import MemoryService
from sgm.memory.kept_home import KeptHome
from sgm.serve.calls import Call
from sgm.serve.guard import Refused

NUM_READERS = 4
MOST_WAITING = 200  # calls at once; more are refused
DEFAULT_TIMEOUT = 10.0  # seconds for a call
SYNC_SECONDS = 1.0


class Caller:
    """Makes the calls of a service, and keeps its memory on disk.

    Writes are made by one thread, in the order in which they came. A line of the log has left the
    process before its call is answered; when the disk has it, `sync` says: "answer" before the
    call is answered, "second" within a second, "never" when the system likes.
    """

    def __init__(
        self,
        service: MemoryService,
        home: KeptHome | None = None,
        sync: str = "second",
        timeout: float = DEFAULT_TIMEOUT,
    ) -> None:
        """Make calls of a service.

        Args:
            service: what is called.
            home: where its memory is kept; None for nowhere.
            sync: as above.
            timeout: seconds for a call.
        """
        self.service = service
        self.home = home
        self.timeout = timeout
        self._sync = sync
        self._readers = ThreadPoolExecutor(NUM_READERS, "sgm-read")
        self._writer = ThreadPoolExecutor(1, "sgm-write")
        self._keeper = ThreadPoolExecutor(1, "sgm-keep")  # of files, for which no caller waits
        self._counting = Lock()
        self._num_waiting = 0
        self.num_writes = 0
        self._num_synced = self._num_saved = 0
        self._told = ""  # the latest warning

    async def call(self, call: Call, arguments: Mapping[str, Any]) -> Any:
        """Make a call, and return its answer.

        Args:
            call: which.
            arguments: as `Call.read` gave them.

        Raises:
            Refused: if too many calls wait, or it takes too long. A write that takes too long may
                still be made.
            KeyError, ValueError: as the method does.
            OSError: if the disk does not take a write; then it was not made.
        """
        if self._num_waiting >= MOST_WAITING:
            raise Refused(503, f"calls must be at most {MOST_WAITING} at once, got more. Wait.")
        with self._counting:
            self._num_waiting += 1
        if call.is_write:
            future = self._writer.submit(self._write, call, arguments)
        else:
            future = self._readers.submit(call.run, self.service, arguments)
        future.add_done_callback(self._count_down)
        try:
            return await asyncio.wait_for(asyncio.wrap_future(future), self.timeout)
        except asyncio.TimeoutError:
            raise Refused(
                503, f"a call must take at most {self.timeout:g} s, got a longer one. Try again."
            ) from None

    def _count_down(self, _: Any) -> None:
        with self._counting:
            self._num_waiting -= 1

    def _write(self, call: Call, arguments: Mapping[str, Any]) -> Any:
        answer = call.run(self.service, arguments)
        self.num_writes += 1
        if self._sync == "answer":
            self.service.memory.sync_log()
        return answer

    async def keep(self, snapshot_seconds: float) -> None:
        """Let time pass, write to the disk and begin logs anew, until it is cancelled.

        Args:
            snapshot_seconds: time between snapshots, while there is something new.
        """
        loop = asyncio.get_running_loop()
        saved_at = loop.time()
        while True:
            await asyncio.sleep(SYNC_SECONDS)
            await self._try(self._writer, self._let_time_pass)
            if self._sync == "second" and self.num_writes > self._num_synced:
                self._num_synced = self.num_writes
                await self._try(self._keeper, self.service.memory.sync_log)
            is_due = loop.time() - saved_at >= snapshot_seconds
            if self.home is not None and self.num_writes > self._num_saved:
                if is_due or self.home.is_log_long:
                    saved_at = loop.time()
                    await self._try(self._keeper, self.save)

    async def _try(self, pool: ThreadPoolExecutor, do: Callable[[], object]) -> None:
        """Do something in a thread; what goes wrong is reported, and tried again later."""
        try:
            await asyncio.get_running_loop().run_in_executor(pool, do)
        except (OSError, ValueError) as error:
            if str(error) != self._told:
                self._told = str(error)
                print(f"warning: {error}", file=sys.stderr, flush=True)

    def save(self) -> None:
        """Write a snapshot, if there is anything new.

        Raises:
            OSError: if the disk does not take it; the log has it all.
        """
        if self.home is not None and self.num_writes > self._num_saved:
            self._num_saved = self.num_writes
            self.home.snapshot()

    def close(self) -> None:
        """Wait for the calls that were begun, and write a snapshot.

        Raises:
            OSError: as `save`.
        """
        for pool in (self._readers, self._writer, self._keeper):
            pool.shutdown(wait=True)
        self.save()

    def _let_time_pass(self) -> None:
        if self.service.let_time_pass():
            self.num_writes += 1

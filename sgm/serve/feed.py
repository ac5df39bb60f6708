"""Tells listeners what has changed, as server-sent events."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress

from sgm.finder.answers import write_json
from sgm.finder.service import MemoryService
from sgm.finder.written import Happened

MOST_LISTENERS = 50
MOST_WAITING = 1000  # events of a listener that does not read; then its connection ends
PULSE_SECONDS = 15.0  # after which a line is sent, so that a dead connection is noticed


class Feed:
    """Hands every change of a service on to listeners, in the order in which they were made."""

    def __init__(self, service: MemoryService) -> None:
        """Hand on what happens to a service; `close` ends it."""
        self._service = service
        self._queues: set[asyncio.Queue[bytes | None]] = set()
        self._loop = asyncio.get_running_loop()
        # Of a subscription, which there is while a client listens: telling costs the writer time.
        self._end: Callable[[], None] | None = None

    @property
    def num_listeners(self) -> int:
        """How many listen."""
        return len(self._queues)

    @property
    def is_full(self) -> bool:
        """Whether no more may listen."""
        return len(self._queues) >= MOST_LISTENERS

    def close(self) -> None:
        """End all connections."""
        for queue in tuple(self._queues):
            self._finish(queue)

    def end_soon(self) -> None:
        """Call `close` from another thread, or from a signal."""
        with suppress(RuntimeError):  # the loop has ended, and all connections with it
            self._loop.call_soon_threadsafe(self.close)

    async def listen(self) -> AsyncIterator[bytes]:
        """Yield events as they are sent, from now on, until it is cancelled or the feed ends."""
        queue: asyncio.Queue[bytes | None] = asyncio.Queue(MOST_WAITING)
        self._queues.add(queue)
        if self._end is None:
            self._end = self._service.subscribe(self._hand_on)
        try:
            yield b": sgm feed\n\n"  # now: the client knows that it is heard
            while True:
                try:
                    event = await asyncio.wait_for(queue.get(), PULSE_SECONDS)
                except asyncio.TimeoutError:
                    event = b": \n\n"
                if event is None:
                    return
                yield event
        finally:
            self._queues.discard(queue)
            if not self._queues and self._end is not None:
                self._end()
                self._end = None

    def _hand_on(self, happened: Happened) -> None:
        """Called by the thread that made the change."""
        event = b"id: %d\nevent: %s\ndata: %s\n\n" % (
            happened.number,
            happened.call.encode(),
            write_json(happened),
        )
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._put, event)

    def _put(self, event: bytes) -> None:
        for queue in tuple(self._queues):
            if queue.full():
                self._finish(queue)
            else:
                queue.put_nowait(event)

    def _finish(self, queue: asyncio.Queue[bytes | None]) -> None:
        """Have a listener end after what it has."""
        self._queues.discard(queue)
        if queue.full():
            queue.get_nowait()
        queue.put_nowait(None)

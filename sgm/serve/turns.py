"""Functions in threads that take turns, so that the event loop has the interpreter between them."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

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

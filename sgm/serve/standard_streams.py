"""MCP over standard input and output, until the client is gone or a signal comes."""

from __future__ import annotations

import asyncio
import os
import signal
from contextlib import suppress

from sgm.serve.caller import Caller
from sgm.serve.tools import MCPTools


async def answer_streams(caller: Caller, snapshot_seconds: float) -> None:
    """Answer until standard input ends or no one reads standard output, and keep the memory.

    SIGINT and SIGTERM end the process with status 0. What was answered is in the file.
    """
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: loop.call_soon_threadsafe(ended.set))
    keeping = asyncio.create_task(caller.keep(snapshot_seconds))
    answering = asyncio.create_task(_answer(MCPTools(caller)))
    waiting = asyncio.create_task(ended.wait())
    await asyncio.wait((answering, waiting), return_when=asyncio.FIRST_COMPLETED)
    for task in (keeping, waiting):
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    if not answering.done():
        caller.close()
        os._exit(0)  # a thread waits for a line of standard input, which may never come
    answering.result()


async def _answer(tools: MCPTools) -> None:
    try:
        await tools.run_stdio()
    except Exception as error:
        if not _is_of_lost_client(error):
            raise


def _is_of_lost_client(error: BaseException) -> bool:
    """Whether an error, or all errors of a group, say that no one reads what is written."""
    parts = getattr(error, "exceptions", ())  # groups are a built-in type from Python 3.11 on
    return isinstance(error, ConnectionError) or (
        bool(parts) and all(map(_is_of_lost_client, parts))
    )

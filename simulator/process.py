"""A command as a process: what it does where its output is not read, or not in all letters."""

from __future__ import annotations

import atexit
import os
import select
import sys
from collections.abc import Callable
from typing import NoReturn


def run_main(main: Callable[[], object], *, leaves_threads: bool = False) -> NoReturn:
    """Run a command and end the process with the status that it returns, 0 if it returns none.

    Letters that the terminal's encoding has not are printed as "?". Where the reader of the output
    has closed it (`| head -1`), the command ends with status 1 and says nothing.

    Args:
        main: reads the command line of the process.
        leaves_threads: whether daemon threads may be at work when it returns. Python would stop
            them wherever they are, which within torch or ONNX Runtime aborts the process; so it
            ends without that.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        found = main()
        status = found if isinstance(found, int) else 0
        sys.stdout.flush()
    except BrokenPipeError:
        if not _is_closed(sys.stdout.fileno()):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is not written
        status = 1
    if leaves_threads:
        atexit._run_exitfuncs()  # temporary folders go, as at any end
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def _is_closed(file: int) -> bool:
    """Tell whether a pipe has no reader any more."""
    poll = select.poll()
    poll.register(file, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))

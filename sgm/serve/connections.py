"""How many connections there are at once: as many as the process may open, idle ones go first."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import sys
import time
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol
from weakref import WeakSet

try:
    import resource
except ModuleNotFoundError:  # Windows has no such limit
    resource = None  # type: ignore[assignment]

IS_POSIX = os.name == "posix"
MOST_CONNECTIONS = 500
_LEAST_CONNECTIONS = 4
# Files that are open beside connections: the memory file, what lies beside it, the event loop.
_OTHER_FILES = 32
_TELL_SECONDS = 3600.0  # between two lines that say that the bound was reached
_NO_FILES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_BUSY = (
    b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/json\r\n"
    b"connection: close\r\ncontent-length: 77\r\n\r\n"
    b'{"error":"connections must be few at once, got too many at work. Try again."}'
)


class Connection(Protocol):
    """What serves a connection."""

    def is_idle(self) -> bool:
        """Whether no request is being answered."""

    def abort(self) -> None:
        """Close at once."""


class Connections:
    """Counts the open connections of a server, and makes room for new ones.

    Attributes:
        most: that may be open at once.
    """

    def __init__(self, most: int, tell: Callable[[str], None]) -> None:
        """Allow so many; `tell` gets a line when that many are open, once an hour at most."""
        self.most = most
        self._tell = tell
        self._told_at = -_TELL_SECONDS
        self._open: WeakSet[socket.socket] = WeakSet()
        self._served: OrderedDict[Connection, None] = OrderedDict()  # the latest in use last

    def open(self, accepted: socket.socket) -> None:
        """Count one that was accepted, until its socket is closed."""
        self._open.add(accepted)

    def use(self, connection: Connection) -> None:
        """Note that one has come, or has read or answered something."""
        self._served[connection] = None
        self._served.move_to_end(connection)

    def close(self, connection: Connection) -> None:
        """Note that one has ended."""
        self._served.pop(connection, None)

    def make_room(self) -> bool | None:
        """Tell whether one more may be open; the one that was idle for longest is closed.

        Returns:
            True if it may; None if there will be room when the event loop has gone round once;
            False if requests are being answered on all of them.
        """
        if len(self._open) >= self.most:
            self._open = WeakSet(accepted for accepted in self._open if accepted.fileno() >= 0)
        if len(self._open) < self.most:
            return True
        self.tell(
            f"{self.most} connections are open, and no more may be: those that were idle for "
            "longest are closed for new ones"
        )
        if len(self._open) > len(self._served):  # some are not yet served, or not yet closed
            return None
        return None if self._close_idle() else False

    def _close_idle(self) -> bool:
        """Close the connection that was idle for longest, if there is one."""
        idle = next((connection for connection in self._served if connection.is_idle()), None)
        if idle is not None:
            del self._served[idle]
            idle.abort()
        return idle is not None

    def handle_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handle an exception of the event loop: `accept` without files in a line, all else so."""
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in _NO_FILES:
            self._close_idle()
            self.tell(f"no connection is accepted for a second: {error.strerror}")
        else:
            loop.default_exception_handler(context)

    def tell(self, line: str) -> None:
        """Say that the bound was reached, once an hour at most."""
        now = time.monotonic()
        if now - self._told_at >= _TELL_SECONDS:
            self._told_at = now
            self._tell(line)


class BoundedSocket(socket.socket):
    """A listening socket that accepts no more connections than may be open at once."""

    connections: Connections
    _is_out_of_files = False

    def accept(self) -> tuple[socket.socket, Any]:
        """Accept a connection; BlockingIOError if the event loop is to go round first."""
        has_room = self.connections.make_room()
        if has_room is None or self._is_out_of_files:
            self._is_out_of_files = False
            raise BlockingIOError
        try:
            accepted, address = super().accept()
        except OSError as error:
            # The event loop asks again at once, and after a second if it got this error.
            self._is_out_of_files = error.errno in _NO_FILES
            raise
        if not has_room:
            with accepted, suppress(OSError):
                accepted.setblocking(False)
                accepted.send(_BUSY)
            raise BlockingIOError
        self.connections.open(accepted)
        return accepted, address


def count_connections() -> int:
    """Return how many connections may be open, by the number of files that the process may open.

    Raises:
        OSError: if these are too few for a server.
    """
    if resource is None:
        return MOST_CONNECTIONS
    most_files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if most_files == resource.RLIM_INFINITY:
        return MOST_CONNECTIONS
    others = len(os.listdir("/dev/fd")) + _OTHER_FILES
    if most_files - others < _LEAST_CONNECTIONS:
        raise OSError(
            errno.EMFILE,
            f"process must be allowed to open {others + _LEAST_CONNECTIONS} files, got "
            f"{most_files}. Raise it: ulimit -n 1024.",
        )
    return min(MOST_CONNECTIONS, most_files - others)


def warn(line: str) -> None:
    """Write a line for the one who runs the server."""
    print(f"warning: {line}", file=sys.stderr, flush=True)

"""Runs the application with uvicorn: on this machine alone or with a token, until a signal."""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
from collections.abc import Callable
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from sgm.serve.application import Application
from sgm.serve.connections import (
    IS_POSIX,
    MOST_CONNECTIONS,
    BoundedSocket,
    Connections,
    count_connections,
    warn,
)

HEAD_SECONDS = 10.0  # in which the head of a request has to arrive
KEEP_ALIVE_SECONDS = 30
GRACE_SECONDS = 5  # for the calls that were begun, when the server ends


class JoinedWrites:
    """A transport that sends together what is written together: the head and body of an answer."""

    def __init__(self, transport: Any, loop: asyncio.AbstractEventLoop) -> None:
        """Write to a transport of a loop."""
        self._transport, self._loop = transport, loop
        self._written: list[bytes] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def write(self, data: bytes) -> None:
        """Send after what is written before the loop goes on."""
        if not self._written:
            self._loop.call_soon(self._send)
        self._written.append(data)

    def close(self) -> None:
        """Close when all was sent."""
        self._send()
        self._transport.close()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Hand the transport on."""
        self._send()
        self._transport.set_protocol(protocol)

    def _send(self) -> None:
        if self._written:
            self._transport.write(b"".join(self._written))
            self._written = []


class BoundedProtocol(H11Protocol):
    """Closes a connection on which no request arrives in time, or whose answers are not read."""

    _timer: asyncio.TimerHandle | None = None
    _write_timer: asyncio.TimerHandle | None = None
    head_seconds = HEAD_SECONDS
    bound: Connections

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        joined: Any = JoinedWrites(transport, self.loop)
        super().connection_made(joined)
        self.bound.use(self)
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Wait for the rest of a head; a request that is answered has limits of its own."""
        self.bound.use(self)
        super().data_received(data)
        if not self.is_idle():
            self._end_waiting()
        elif self._timer is None:
            self._wait()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        if not self.transport.is_closing():
            self.bound.use(self)
        super().on_response_complete()

    def pause_writing(self) -> None:
        """Begin to wait for the client to read: more is on its way than the transport takes."""
        super().pause_writing()
        self._write_timer = self.loop.call_later(self.head_seconds, self.transport.abort)

    def resume_writing(self) -> None:
        """The client reads on."""
        super().resume_writing()
        self._end_waiting_for_reader()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._end_waiting()
        self._end_waiting_for_reader()
        self.bound.close(self)
        super().connection_lost(exc)

    def is_idle(self) -> bool:
        """Whether no request is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def abort(self) -> None:
        """Close at once."""
        self.transport.abort()

    def _wait(self) -> None:
        self._timer = self.loop.call_later(self.head_seconds, self._close)

    def _end_waiting(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _end_waiting_for_reader(self) -> None:
        if self._write_timer is not None:
            self._write_timer.cancel()
            self._write_timer = None

    def _close(self) -> None:
        self._timer = None
        if self.is_idle() and not self.transport.is_closing():
            self.transport.close()


class Server(uvicorn.Server):
    """Ends the feed when it is to end, so that nothing waits for its listeners."""

    def __init__(
        self, config: uvicorn.Config, application: Application, listening: BoundedSocket
    ) -> None:
        """Run an application that is asked at a socket."""
        super().__init__(config)
        self._application = application
        self._listening = listening

    def run_until_end(self) -> None:
        """Answer until the end."""
        self.run(sockets=[self._listening])

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer."""
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._listening.connections.handle_error)
        await super().startup(sockets)

    def handle_exit(self, sig: int, frame: Any) -> None:
        """End, for a signal."""
        super().handle_exit(sig, frame)
        self.end()

    def end(self) -> None:
        """End, from any thread."""
        self.should_exit = True
        feed = self._application.feed
        if feed is not None:
            feed.end_soon()


def open_socket(host: str, port: int) -> BoundedSocket:
    """Listen at an address, port 0 for any that is free; raises OSError, which names it."""
    try:
        # With the protocol: asyncio sets TCP_NODELAY where a socket names it. Without, the second
        # packet of an answer waits until the client has acknowledged the first, up to 40 ms.
        addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        family, socket_type, protocol, *_ = addresses[0]
        listening = BoundedSocket(family, socket_type, protocol)
        try:
            # In Windows another server could take an address with it that is in use.
            if IS_POSIX:
                listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind((host, port))
            listening.listen(128)
        except BaseException:
            listening.close()
            raise
    except OSError as error:
        raise OSError(
            f"address must be free, got {error.strerror} for {host}:{port}. Choose another --port."
        ) from None
    return listening


def make_server(application: Application, listening: BoundedSocket) -> Server:
    """Make a server of a socket of `open_socket`, of as many connections as it may have.

    Raises:
        OSError: if the process may open too few files.
    """
    most = count_connections()
    if most < MOST_CONNECTIONS:
        warn(f"at most {most} connections at once: the process may open few files (ulimit -n)")
    connections = listening.connections = Connections(most, warn)
    protocol = type("Protocol", (BoundedProtocol,), {"bound": connections})
    logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)  # errors are answered in a line
    config = uvicorn.Config(
        application,
        http=protocol,
        ws="none",
        loop="asyncio",
        lifespan="on",
        access_log=False,
        log_config=None,
        server_header=False,
        date_header=False,
        proxy_headers=False,
        timeout_keep_alive=KEEP_ALIVE_SECONDS,
        timeout_graceful_shutdown=GRACE_SECONDS,
        # Windows accepts connections without the socket: those that are too many are answered 503.
        limit_concurrency=None if IS_POSIX else most + 1,
    )
    return Server(config, application, listening)


def serve(application: Application, listening: BoundedSocket, begin: Callable[[], None]) -> None:
    """Answer until Ctrl-C or SIGTERM, then end what was begun, and return.

    `begin` is called when signals are obeyed.
    """
    server = make_server(application, listening)
    # uvicorn takes signals over while it runs, and afterwards sends itself again what it got.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.end())
    begin()
    server.run_until_end()

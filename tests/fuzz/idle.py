"""Connections that send nothing, half a request or odd bytes: others are answered meanwhile."""

from __future__ import annotations

import functools
import http.client
import socket
import threading
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import serve_requests

from sgm.serve import server

Rng = np.random.Generator
MOST = 12  # connections of the server
SENT = (
    b"",
    b"\x16\x03\x01",
    b"GET /health HTTP/1.1\r\nHost:",
    b"GET /health HTTP/1.1\r\n\r\n" * 3,
    b"POST /v1/observe HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n",
    b"GET /health HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n",
    b"\r\n" * 5000,
)


@functools.cache
def get_port() -> int:
    """Return the port of a server that answers in this process from now on."""
    listening = server.open_socket("127.0.0.1", 0)
    running = server.make_server(serve_requests.get_application(), listening)
    listening.connections.most = MOST
    threading.Thread(target=running.run_until_end, daemon=True).start()
    return int(listening.getsockname()[1])


def make(folder: Path) -> None:
    """Write a seed."""
    (folder / "plan").write_text("0")


def change(folder: Path, rng: Rng) -> None:
    """Write another seed."""
    (folder / "plan").write_text(str(rng.integers(2**62)))


def use(folder: Path) -> None:
    """Open and leave connections, and ask on one."""
    rng = np.random.default_rng(int((folder / "plan").read_text()))
    with ExitStack() as stack:
        held: list[socket.socket] = []
        for _ in range(int(rng.integers(3 * MOST))):
            one = socket.create_connection(("127.0.0.1", get_port()), timeout=15)
            held.append(stack.enter_context(one))
            try:
                one.sendall(SENT[int(rng.integers(len(SENT)))])
                if rng.random() < 0.3:
                    held.pop(int(rng.integers(len(held)))).close()
            except OSError:  # it was closed for another one
                pass
        for _ in range(3):
            _ask()


def _ask() -> None:
    """Ask as a client does that tries again, where all connections are at work."""
    for _ in range(50):
        connection = http.client.HTTPConnection("127.0.0.1", get_port(), timeout=15)
        try:
            connection.request("GET", "/health")
            status = connection.getresponse().status
        except (ConnectionError, http.client.HTTPException):  # closed for another one
            continue
        finally:
            connection.close()
        assert status in (200, 503)
        if status == 200:
            return
    raise AssertionError("no answer after 50 tries")

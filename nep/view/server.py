"""Serves the page to this machine alone."""

from __future__ import annotations

import logging
import socket
import webbrowser
from collections.abc import Callable
from threading import Thread
from typing import TYPE_CHECKING

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.replay.still_memory import StillMemory

if TYPE_CHECKING:
    from werkzeug.serving import BaseWSGIServer

HOST = "127.0.0.1"
DEFAULT_PORT = 8050
_MOST_PAGES = 50  # beside each other on one machine


def show(
    memory: SceneGraphMemory | Callable[[], SceneGraphMemory],
    title: str = "robot",
    port: int = DEFAULT_PORT,
    opens_browser: bool = True,
) -> str:
    """Open a page on the memory of a running program; it follows what the memory learns.

    The page is served by a thread of the program and ends with it.

    Example:
        >>> show(memory)
        'http://127.0.0.1:8050/'

    Args:
        memory: the memory that the program goes on to change, or a function that returns it.
        title: of the page.
        port: of this machine; the next free one is taken.
        opens_browser: whether to open the page in the browser.

    Returns:
        The address of the page.

    Raises:
        ModuleNotFoundError: if dash is not installed.
        OSError: if no port is free.
    """
    get = memory if callable(memory) else lambda: memory

    def get_state() -> tuple[int, ...]:
        batch = get().batch
        looks = int(batch.furniture_num_observed.sum())
        return (id(batch), batch.time, looks, batch.num_furniture, len(batch.edges))

    stage = Stage(lambda: StillMemory(get().copy(), title), get_state)
    server, address = start(Desk(stage, Judges()), port)
    Thread(target=server.serve_forever, daemon=True).start()
    if opens_browser:
        webbrowser.open(address)
    return address


def start(desk: Desk, port: int = DEFAULT_PORT, asked: str = "") -> tuple[BaseWSGIServer, str]:
    """Make the server of a page, which `serve_forever` runs.

    Args:
        desk: answers.
        port: of this machine; the next free one is taken.
        asked: what is asked at first.

    Returns:
        The server, and its address.

    Raises:
        ModuleNotFoundError: if dash is not installed.
        OSError: if no port is free.
    """
    try:
        from werkzeug.serving import make_server

        from nep.view.app import make_app
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"the page must find the package dash, got none ({error}). Install it with "
            "`pip install scene-graph-memory[view]`, or save the page to a file with --save."
        ) from error
    app = make_app(desk, asked)
    Thread(target=desk.judges.get, args=(desk.judges.names[0],), daemon=True).start()  # seconds
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    with _find_socket(port) as free:
        number = free.getsockname()[1]
        server = make_server(HOST, number, app.server, threaded=True, fd=free.fileno())
    return server, f"http://{HOST}:{number}/"


def _find_socket(port: int) -> socket.socket:
    """Return a socket that listens at the first free port from a number on."""
    for number in range(port, port + _MOST_PAGES):
        free = socket.socket()
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            free.bind((HOST, number))
            free.listen()
            return free
        except (OSError, OverflowError):
            free.close()
    raise OSError(
        f"port must be free on this machine, got none from {port} to {port + _MOST_PAGES - 1}. "
        "Choose another one with --port."
    )

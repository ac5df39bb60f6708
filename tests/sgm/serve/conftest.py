"""A small home behind a server in this process, and a client."""

import http.client
import json
import threading
from contextlib import contextmanager
from datetime import datetime
from types import SimpleNamespace

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.serve.caller import Caller
from sgm.serve.guard import Guard

START = datetime(2026, 11, 16, 7, 30)
ALIASES = {
    "scissors": ["thing to cut paper", "thing to cut with"],
    "paper knife": {"aliases": ["thing to cut paper"]},
}


def open_service(path, aliases=ALIASES, now=lambda: START):
    """A service of a kept home with three places and some things."""
    home = SceneGraphMemory.open(path, clock=Clock(START, 600), aliases=aliases, is_new=True)
    service = MemoryService(home, Finder(Bayesian()), now)
    if not home.num_furniture:
        service.add_room("kitchen")
        service.add_room("study")
        service.add_place("fridge", "kitchen", "white fridge", (1, 4))
        service.add_place("counter top", "kitchen", None, (3, 4))
        service.add_place("desk", "study", None, (6, 1))
        seen = ("large red mug", "eyeglasses", "wine glass", "scissors", "paper knife")
        service.observe("desk", [Sighting(name) for name in seen])
        service.observe("white fridge", [Sighting("milk", "in")])
    return home, service


class Client:
    """Asks a server over one connection."""

    def __init__(self, port, token=None):
        self.port = port
        self.headers = {"Content-Type": "application/json"}
        if token:
            self.headers["Authorization"] = f"Bearer {token}"
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)

    def send(self, method, path, body=None, headers=None):
        """Status, headers and text of the answer."""
        try:
            self._connection.request(method, path, body, {**self.headers, **(headers or {})})
            answer = self._connection.getresponse()
            return SimpleNamespace(
                status=answer.status, headers=answer.headers, text=answer.read().decode()
            )
        except BaseException:
            self._connection.close()
            raise

    def call(self, name, /, **arguments):
        """The answer of a call."""
        answer = self.send("POST", f"/v1/{name}", json.dumps(arguments))
        assert answer.status == 200, answer.text
        return json.loads(answer.text)

    def close(self):
        self._connection.close()


@contextmanager
def run_server(service, guard=None, tools=True, most_connections=None, **settings):
    """A server in a thread: its port, application and caller."""
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    own = {key: settings.pop(key) for key in ("sync", "timeout", "reader") if key in settings}
    caller = Caller(service, **own)
    if tools:
        pytest.importorskip("mcp", reason="mcp is not installed")
    application = server.Application(caller, guard or Guard(), has_tools=tools, **settings)
    listening = server.open_socket("127.0.0.1", 0)
    running = server.make_server(application, listening)
    if most_connections is not None:
        listening.connections.most = most_connections
    thread = threading.Thread(target=running.run_until_end, daemon=True)
    thread.start()
    try:
        yield SimpleNamespace(
            port=listening.getsockname()[1], application=application, caller=caller
        )
    finally:
        running.end()
        thread.join(20)
        assert not thread.is_alive()
        caller.close()


@pytest.fixture
def served(tmp_path):
    """A home that is served: `port`, `client`, `service`, `home`, `application`."""
    home, service = open_service(tmp_path / "home.sgm")
    with run_server(service) as running:
        client = Client(running.port)
        yield SimpleNamespace(**vars(running), client=client, service=service, home=home)
        client.close()

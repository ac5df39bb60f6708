"""Requests to the server that no client sends: an answer, or a line, never a traceback."""

from __future__ import annotations

import asyncio
import functools
import json
from datetime import datetime
from pathlib import Path
from typing import Any

import mutate
import numpy as np
import targets

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.policies import Bayesian
from sgm.serve.application import Application
from sgm.serve.caller import Caller
from sgm.serve.calls import CALLS, REQUIRED
from sgm.serve.guard import Guard

Rng = np.random.Generator
# Good values, by the name of an argument.
GOOD = {
    "thing": "mug",
    "at": 9,
    "k": 3,
    "in_use": True,
    "from": [1, 2],
    "budget": 9,
    "search_id": "x",
    "result": "found",
    "seen": ["mug", {"thing": "pen", "confidence": 0.5}],
    "coverage": 0.5,
    "place": 0,
    "by": "anna",
    "relation": "in",
    "confidence": 0.9,
    "was_at": 0,
    "room": "kitchen",
    "kind": "mug",
    "since": 0,
    "label": "sink",
    "other": "pen",
    "name": "white sink",
    "position": [1, 2],
    "text": "where is my mug?",
    "speaker": "anna",
    "look": 1,
    "key": "write 1",
    "center": [1, 2, 0.5],
    "size": [0.6, 1.2, 1],
    "yaw": 0.3,
    "interior": "door",
    "open_cost": 2.5,
    "polygon": [[0, 0], [1, 0], [1, 1]],
    "bottom": 0,
    "top": 0.7,
    "rooms": [{"name": "kitchen", "id": 0, "floor": [[0, 0], [4, 3]]}, {"name": "hall"}],
    "furniture": [{"name": "shelf", "room": "kitchen", "position": [1, 2], "is_open": True}],
    "frame": "map",
    "angle": 0.5,
    "shift": [1, 2],
    "map_id": "new map",
}
ODD = (*mutate.VALUES, 10**400, -(2**63), "2026-11-16T18:30", "\ud800", "a\nb", ["x"] * 600)
HEADERS = (
    ("Origin", "http://evil"),
    ("Host", "evil"),
    ("Content-Type", "text/plain"),
    ("Content-Length", "-1"),
    ("Content-Length", "9" * 30),
    ("Authorization", "Bearer \xff"),
)


@functools.cache
def get_application() -> Application:
    """Return a server of a small memory."""
    service = MemoryService(targets.make_memory(), Finder(Bayesian()), now=datetime.now)
    return Application(Caller(service), Guard(rate=1e9))


def make_request(folder: Path) -> None:
    """Write a good request."""
    write(folder, "POST", "/v1/where_is", "", {}, json.dumps({"thing": "mug"}).encode())


def write(
    folder: Path, method: str, path: str, query: str, headers: dict[str, str], body: bytes
) -> None:
    """Write what is sent."""
    head = {"method": method, "path": path, "query": query, "headers": headers}
    (folder / "head").write_text(json.dumps(head))
    (folder / "body").write_bytes(body)


def change(folder: Path, rng: Rng) -> None:
    """Forge a value, the frame around it, bytes, or a head."""
    call, kind = CALLS[int(rng.integers(len(CALLS)))], int(rng.integers(7))
    values: Any = {
        one.name: GOOD[one.name]
        for one in call.arguments
        if one.default is REQUIRED or rng.integers(2)  # some go together with no other
    }
    method, path, query, headers = "POST", f"/v1/{call.name}", "", {}
    if kind <= 2:
        for _ in range(int(rng.integers(1, 3))):
            name = str(rng.choice([*values, "none"]))
            odd = ODD[int(rng.integers(len(ODD)))]
            values[name] = mutate.mutate_json(values.get(name), rng) if kind == 2 else odd
    elif kind == 3:
        values = mutate.mutate_json(values, rng)
    elif kind == 4:
        method, query = "GET", "&".join(f"{key}={value}" for key, value in values.items())
        query = mutate.mutate_bytes(query.encode(), rng).decode("latin-1")
    elif kind == 5:
        name, value = HEADERS[int(rng.integers(len(HEADERS)))]
        headers[name] = value
        path = str(rng.choice([path, "/v1/", "/", "/health", "/v1/../x", "/\x00", "/metrics"]))
    body = json.dumps(values).encode()
    if kind == 6:
        body = mutate.mutate_bytes(body, rng)
    write(folder, method, path, query, headers, body)


def use(folder: Path) -> None:
    """Send it."""
    head = json.loads((folder / "head").read_text())
    headers = {"Host": "localhost", "Content-Type": "application/json", **head["headers"]}
    scope = {
        "type": "http",
        "method": head["method"],
        "path": head["path"],
        "query_string": head["query"].encode("latin-1"),
        "client": ("127.0.0.1", 1),
        "headers": [(k.lower().encode(), v.encode("latin-1")) for k, v in headers.items()],
    }
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        body = (folder / "body").read_bytes()
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(get_application()(scope, receive, send))
    status, body = sent[0]["status"], sent[1]["body"]
    assert status < 500, body
    if status >= 400:
        line = json.loads(body)["error"]
        assert "\n" not in line
        raise ValueError(line)
    if head["path"].startswith("/v1/"):
        assert json.loads(body)["status"] in ("ok", "ambiguous", "unknown")

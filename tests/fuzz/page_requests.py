"""Requests to the page that no browser sends: an answer or a line, never a traceback."""

from __future__ import annotations

import functools
import json
import logging
import sys
from pathlib import Path
from typing import Any

import mutate
import numpy as np
import targets

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from nep.view.server import CALLS, PageServer
from simulator.story.past_memory import StillMemory

Rng = np.random.Generator
# A good value of each argument.
GOOD = {"step": 0, "since": 0, "words": "mug", "judge": "bayesian", "furniture": 0}
ODD = (
    *mutate.VALUES,
    "evilmod:P",
    "os:system",
    "numpy.zeros",
    ".:",
    "..x:y",
    10**400,
    -(2**53),
    [10**9] * 4,
    "none",
    {"words": "mug"},
    "\ud800",
    "x" * 201,
)
PATHS = ("/x.js", "/page/../x", "/%2e%2e/x", "/?call=watch", "//", "/page.css")


@functools.cache
def get_server() -> PageServer:
    """Return a page on a small memory."""
    memory = targets.make_memory()
    desk = Desk(Stage(lambda: StillMemory(memory, "home")), Judges())
    desk.judges.names = ["bayesian", "last_seen_prior"]  # no seconds for torch
    return PageServer(desk)


def make_body(call: str) -> dict[str, Any]:
    """Return what a browser sends for a call."""
    step = get_server().desk.stage.story.num_steps
    return {"call": call, **{name: {**GOOD, "step": step}[name] for name in CALLS[call][0]}}


def make_request(folder: Path) -> None:
    """Write a good request."""
    write_request(folder, "POST /", json.dumps(make_body("answer")).encode())


def write_request(folder: Path, line: str, content: bytes) -> None:
    """Write what is sent."""
    (folder / "line").write_text(line)
    (folder / "body").write_bytes(content)


def change(folder: Path, rng: Rng) -> None:
    """Forge a value, the frame around it, bytes, or a path."""
    body, kind = make_body(list(CALLS)[int(rng.integers(len(CALLS)))]), rng.integers(8)
    line = "POST /"
    if kind <= 3:  # a value of its own, or two
        for _ in range(int(rng.integers(1, 3))):
            name = list(body)[int(rng.integers(len(body)))]
            value = ODD[int(rng.integers(len(ODD)))]
            body[name] = mutate.mutate_json(body[name], rng) if kind == 3 else value
    elif kind == 4:
        body = mutate.mutate_json(body, rng)
    elif kind == 5:
        line = f"{rng.choice(['GET', 'POST', 'HEAD', 'PUT'])} {rng.choice(PATHS)}"
    content = json.dumps(body).encode()
    if kind == 6:
        content = mutate.mutate_bytes(content, rng)
    elif kind == 7:
        levels = int(rng.choice([100, 1000, 100_000]))
        deep = ("[" * levels + "]" * levels).encode()
        content = deep if rng.random() < 0.3 else content.replace(b'"mug"', deep)
    write_request(folder, line, content)


class _Records(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(self.format(record))


def use(folder: Path) -> None:
    """Send it."""
    method, path = (folder / "line").read_text().split()
    records = _Records()
    logging.getLogger().addHandler(records)
    try:
        status, _, answer = get_server().respond(
            method, path, {"host": "127.0.0.1:8050"}, (folder / "body").read_bytes()
        )
    finally:
        logging.getLogger().removeHandler(records)
    assert status < 500, status
    assert not records.lines, records.lines
    assert "evilmod" not in sys.modules
    if status >= 400:
        raise ValueError(answer.decode().strip())

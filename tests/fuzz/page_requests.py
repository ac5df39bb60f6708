"""Requests to the page that no browser sends: an answer, a line or nothing, never a traceback."""

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
from dash import Dash

from nep.view.answers import Desk
from nep.view.app import make_app
from nep.view.page_state import Judges, Stage
from simulator.replay.still_memory import StillMemory

Rng = np.random.Generator
# A good value of each input, by the end of its name.
GOOD = {
    "n_clicks": 1, "n_submit": 1, "n_intervals": 1, "disabled": True, "max": 4,
    "relayoutData": {f"{axis}axis.range[{end}]": end for axis in "xy" for end in (0, 1)},
    "clickData": {"points": [{"customdata": ["furniture", 0]}]}, "asked.data": "mug",
    "object.data": "mug", "version.data": 0, "selected.data": 0, "words.value": "mug",
    "step.value": 3, "judge-a.value": "bayesian", "judge-b.value": "nobody",
    "options.value": ["search plan"], "view-a.data": [0, 1, 0, 1], "view-b.data": None,
}  # fmt: skip
ODD = (
    *mutate.VALUES, "evilmod:P", "os:system", "numpy.zeros", ".:", "..x:y", 10**400, -(2**53),
    [10**9] * 4, ["truth"] * 3, {"points": [{"customdata": ["furniture", 10**30]}]}, "\ud800",
)  # fmt: skip
PATHS = ("/_dash-component-suites/os/x.js", "/_dash-component-suites/dash/../x", "/assets/../x",
         "/_reload-hash", "/_dash-layout", "/%2e%2e/x", "/_dash-update-component/x")  # fmt: skip


@functools.cache
def get_app() -> Dash:
    """Return a page on a small memory."""
    memory = targets.make_memory()
    desk = Desk(Stage(lambda: StillMemory(memory, "home")), Judges())
    desk.judges.names = ["bayesian", "last_seen_prior"]  # no seconds for torch
    return make_app(desk)


def make_body(output: str) -> dict[str, Any]:
    """Return what a browser sends to a callback."""
    callback = get_app().callback_map[output]
    names = output[2:-2].split("...") if output.startswith("..") else [output]
    outputs = [dict(zip(("id", "property"), name.rsplit(".", 1), strict=True)) for name in names]
    rows: dict[str, Any] = {
        part: [
            {**row, "value": GOOD.get(f"{row['id']}.{row['property']}", GOOD.get(row["property"]))}
            for row in callback[part]
        ]
        for part in ("inputs", "state")
    }
    first = callback["inputs"][0]
    return {
        "output": output,
        "outputs": outputs if output.startswith("..") else outputs[0],
        "changedPropIds": [f"{first['id']}.{first['property']}"],
        **rows,
    }


def make_request(folder: Path) -> None:
    """Write a good request."""
    output = next(name for name in get_app().callback_map if "map-a.figure" in name)
    write_request(folder, "POST /_dash-update-component", json.dumps(make_body(output)).encode())


def write_request(folder: Path, line: str, content: bytes) -> None:
    """Write what is sent."""
    (folder / "line").write_text(line)
    (folder / "body").write_bytes(content)


def change(folder: Path, rng: Rng) -> None:
    """Forge a value, the frame around it, bytes, or a path."""
    outputs = list(get_app().callback_map)
    body, kind = make_body(outputs[int(rng.integers(len(outputs)))]), rng.integers(8)
    line = "POST /_dash-update-component"
    if kind <= 3:  # a value of its own, or two
        rows = [*body["inputs"], *body["state"]]
        for _ in range(int(rng.integers(1, 3))):
            row = rows[int(rng.integers(len(rows)))]
            value = ODD[int(rng.integers(len(ODD)))]
            row["value"] = mutate.mutate_json(row["value"], rng) if kind == 3 else value
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
    app = get_app()
    app.server.logger.addHandler(records)
    try:
        found = app.server.test_client().open(
            path, method=method, data=(folder / "body").read_bytes(),
            content_type="application/json", headers={"Host": "127.0.0.1:8050"},
        )  # fmt: skip
    finally:
        logging.getLogger().removeHandler(records)
        app.server.logger.removeHandler(records)
    assert found.status_code < 500, f"{found.status_code}: {''.join(records.lines)[-1000:]}"
    assert not records.lines, records.lines
    assert "evilmod" not in sys.modules
    if found.status_code == 400:
        raise ValueError(found.text.strip())

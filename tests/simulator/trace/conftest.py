"""A home typed in by hand: two rooms, three furniture nodes, three objects, six hours."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

LAYOUT = {
    "rooms": ["kitchen", "bedroom 1"],
    "furniture": [
        {"name": "table", "room": "kitchen"},
        {"name": "shelf_1", "room": "Kitchen", "description": "oak shelf"},
        {"name": "shelf 2", "room": "bedroom 1"},
    ],
}
# Steps of an hour from t = 0 at second 0: the mug goes out and back within step 2, and moves in
# step 3; the pen comes in step 3, into the slot that the milk leaves; the book changes its
# relation in step 4 and its room in step 6.
EVENTS = """time_s,object,furniture,relation,description
0,mug,table,onTop,large red mug
0,milk,Table,in,
0,book 7,shelf 1,in,
3700,mug,shelf 1,in,
7200,mug,table,onTop,large red mug
7300,mug,shelf 1,in,
9000,milk,,,
10800,pen,shelf 2,onTop,
14400,book 7,shelf 1,onTop,
21600,book 7,shelf 2,onTop,
"""


@pytest.fixture
def good_events() -> str:
    return EVENTS


@pytest.fixture
def write_home(tmp_path) -> Callable[..., Path]:
    def write(
        layout: object = LAYOUT, events: str = EVENTS, name: str = "home", **more: object
    ) -> Path:
        folder = tmp_path / name
        folder.mkdir()
        text = layout if isinstance(layout, str) else json.dumps({**layout, **more})
        (folder / "layout.json").write_text(text, encoding="utf-8")
        (folder / "events.csv").write_text(events, encoding="utf-8")
        return folder

    return write

"""Every query of the page on the database runs, and finds something in a home of a week."""

import re
import sqlite3
from contextlib import closing
from datetime import datetime, timedelta

import pytest

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.store.connection import connect
from tests.guides import DOCS

PAGE = (DOCS / "database.md").read_text(encoding="utf-8")
QUERIES = re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("home") / "home.sgm"
    start = datetime.now().replace(microsecond=0) - timedelta(days=40)
    with SceneGraphMemory(clock=Clock(start, 3600), path=path) as memory:
        kitchen = memory.add_room("kitchen")
        table, shelf = (memory.add_furniture(label, kitchen) for label in ("table", "shelf"))
        memory.observe(table, [Sighting("old hat", confidence=0.55)])
        memory.step(39 * 24)
        memory.observe(table, [Sighting("keys"), Sighting("red mug")])
        memory.step()
        memory.observe(shelf, [Sighting("keys")])
        memory.note_moved("keys", table, by="anna")
    return path


def test_there_are_ten():
    assert len(QUERIES) == 10


@pytest.mark.parametrize("query", QUERIES)
def test_a_query_finds_something(path, query):
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
        assert connection.execute(query).fetchall()


@pytest.mark.parametrize("name", ["sightings", "statements", "moves"])
def test_the_columns_of_views_are_those_of_the_page(path, name):
    (row,) = re.findall(rf"^\| `{name}` \(view\) \| .* \| (.*) \|$", PAGE, re.MULTILINE)
    with closing(connect(path, writes=False)) as connection:
        found = connection.execute(f"SELECT * FROM {name}").description
    assert re.findall(r"`(\w+)`", row) == [column[0] for column in found]

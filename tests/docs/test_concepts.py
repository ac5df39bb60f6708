"""Concepts have a picture and an equation; tables that the site makes say what the code has."""

import re
import sqlite3
from contextlib import closing

import pytest

from datamodules.feature_config import FEATURES
from docs.make_tables import list_columns, list_evidence, list_features
from sgm import SceneGraphMemory, Sighting
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.schema import HOME
from tests.guides import DOCS, read_page

CONCEPTS = ("memory", "belief", "questions", "priors", "time")


@pytest.mark.parametrize("concept", CONCEPTS)
def test_a_concept_has_one_picture_and_one_equation(concept):
    text = read_page(f"concepts/{concept}.md")
    assert text.count("![") == 1
    assert text.count("\n$$\n") == 2  # before and after
    assert (DOCS / "images" / f"concept-{concept}.png").is_file()


def test_the_page_of_columns_says_what_a_memory_file_holds(tmp_path):
    """Of a file as it is: what its snapshot has by name, and the numbers of the home."""
    memory = SceneGraphMemory()
    shelf, hook = (
        memory.add_furniture(name, memory.add_room("hall")) for name in ("shelf", "hook")
    )
    memory.observe(shelf, [Sighting("keys", position=(1, 2, 3))])
    memory.note_absent(hook, "keys")
    memory.save(tmp_path / "home.sgm")
    with closing(sqlite3.connect(tmp_path / "home.sgm")) as database:
        held = {name for (name,) in database.execute("SELECT name FROM snapshot_arrays")}
    shown = set(re.findall(r"^\| `(\w+)` \| `(\w+)` \| \w", list_columns(), re.MULTILINE))
    named = {f"{table}.{column}" for table, column in shown}
    of_tables = {name.replace("_counters.", ".") for name in held if "." in name}
    assert {"edges.object", "furniture.num_observed", "positions.object"} <= of_tables <= named
    assert {("home", column.name) for column in HOME} <= shown


def test_the_page_of_evidence_has_a_row_for_each():
    shown = re.findall(r"^\| `([\w.]+)` \| .+ \| .+ \|$", list_evidence(), re.MULTILINE)
    assert shown == [*PLACE_COLUMNS, *QUESTION_COLUMNS]


def test_the_page_of_the_network_says_how_wide_its_inputs_are():
    page = read_page("reference/network.md")
    assert f"`place` | (Q, F, {len(PLACE_COLUMNS)})" in page
    assert f"`question` | (Q, 1, {len(QUESTION_COLUMNS)})" in page


def test_the_page_of_features_has_a_row_for_each():
    rows = list_features().splitlines()[4:]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows] == [
        feature.name for feature in FEATURES
    ]

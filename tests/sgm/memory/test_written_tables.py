"""Columns that are declared: what follows from a declaration."""

import numpy as np
import pytest

from sgm.memory.written_tables import (
    check_tables,
    keep_rows,
    list_written,
    make_empty_tables,
    read_tables,
    write_tables,
)
from sgm.schema import HOME, NOW, TABLES, Column
from simulator import SceneGraphMemory, Sighting

BESIDE = Column("beside", default=-1, low=-1, refers_to="furniture")


@pytest.mark.parametrize("columns", [*TABLES.values(), HOME], ids=[*TABLES, "home"])
def test_declarations_hold_together(columns):
    assert len({column.name for column in columns}) == len(columns)
    for number, column in enumerate(columns):
        assert column.low <= column.default
        assert column.high == NOW or column.default <= column.high
        assert column.refers_to in ("", "labels", *TABLES)
        if column.guess is not None:  # of what was declared before it
            own = {other.name: np.ones(2, int) for other in columns[:number]}
            assert column.guess(own, {"first_observed": np.zeros(2, int)}).shape == (2,)


@pytest.fixture
def content(monkeypatch):
    """Tables of two places and three objects, two of them seen; with a new column."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    fridge, shelf = (memory.add_furniture(label, room) for label in ("fridge", "shelf"))
    memory.observe(fridge, [Sighting("milk", "in"), Sighting("cup", confidence=0.75)])
    memory.step()
    memory.observe(shelf, [Sighting("cup")])
    tables = memory._state.get_content().tables
    monkeypatch.setitem(TABLES, "objects", (*TABLES["objects"], BESIDE))
    return {**tables, "objects": {**tables["objects"], "beside": np.array([-1, 1])}}


def test_a_new_column_is_written_and_read(content):
    data = write_tables(content)
    assert data["objects"]["beside"].tolist() == [-1, 1]
    again = read_tables(data)
    for table, columns in content.items():
        for name, values in columns.items():
            assert again[table][name].tolist() == values.tolist(), (table, name)
    rows = {"furniture": 2, "objects": 2, "edges": 3, "positions": 0, "lone_looks": 0}
    check_tables(again, rows, 1)


def test_what_is_as_guessed_is_in_no_file_and_read_so(content):
    content["objects"]["beside"] = np.array([-1, -1])
    data = write_tables(content)
    assert "beside" not in data["objects"]
    assert read_tables(data)["objects"]["beside"].tolist() == [-1, -1]
    del data["objects"]["num_observed"]  # the first: it says how many there are
    with pytest.raises(KeyError, match="num_observed"):
        read_tables(data)


def test_positions_follow_when_rows_are_left_out(content):
    kept = {"furniture": np.array([False, True]), "objects": np.array([False, True])}
    left, is_edge = keep_rows(content, kept)
    assert left["objects"]["beside"].tolist() == [0]
    assert left["objects"]["last_furniture"].tolist() == [0]
    # Edges: milk and cup on the fridge, cup on the shelf.
    assert is_edge.tolist() == [False, False, True]
    assert left["edges"]["object"].tolist() == left["edges"]["furniture"].tolist() == [0]
    assert left["furniture"]["num_observed"].tolist() == [1]
    none = {"furniture": np.array([True, False]), "objects": np.array([True, True])}
    assert keep_rows(content, none)[0]["objects"]["beside"].tolist() == [-1, -1]


@pytest.mark.parametrize(
    ("table", "name", "values", "message"),
    [
        ("objects", "beside", [2, 0], r"objects beside must lie in -1 to 1, got 2"),
        ("objects", "beside", [0], r"objects beside: 1 rows instead of 2"),
        ("objects", "last_moved", [2, 0], r"last_moved must lie in -1 to 1, got 2"),
        ("edges", "confidence", [0, 0, np.nan], r"confidence must lie in 0 to 1, got nan"),
        ("edges", "object", [0, 0, -1], r"object must lie in 0 to 1, got -1"),
        ("furniture", "num_observed", [0, -1], r"furniture_counters num_observed must lie in 0"),
    ],
)
def test_values_out_of_bounds_are_refused(content, table, name, values, message):
    content[table][name] = np.array(values)
    with pytest.raises(ValueError, match=message):
        check_tables(content, {"furniture": 2, "objects": 2, "edges": 3}, 1)


def test_no_rows():
    empty = make_empty_tables()
    assert {name: list(columns) for name, columns in empty.items()} == {
        name: [column.name for column in list_written(name)] for name in TABLES
    }
    check_tables(read_tables(write_tables(empty)), dict.fromkeys(TABLES, 0), 0)

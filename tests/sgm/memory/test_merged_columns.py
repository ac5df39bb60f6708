"""Every column says how rows that become one are merged, and merging follows what it says."""

from dataclasses import replace

import numpy as np
import pytest

from sgm.arrays.table import make_table
from sgm.memory.merged_rows import Groups, merge_rows
from sgm.memory.merged_things import fuse_edges, fuse_objects
from sgm.memory.same_furniture import merge_places
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.memory.written_tables import list_written
from sgm.schema import (
    EDGES,
    HOME,
    MERGE_RULES,
    OBJECTS,
    SUM,
    TABLES,
    Column,
    Merge,
    check_columns,
)

COLUMNS = [(table, column) for table, columns in TABLES.items() for column in columns]
IDS = [f"{table}-{column.name}" for table, column in COLUMNS]
KEYS = ("object", "furniture", "relation")
# Of two rows, the second is the newer; its other values are the lower ones.
OLDER, NEWER = 7, 5


def make_rows(columns, seed=0):
    """Two rows of numbers that differ in every column but the keys."""
    rows = {column.name: np.array([OLDER, NEWER]) for column in columns}
    for name in ("last_observed", "last_true", "time"):
        if name in rows:
            rows[name] = np.array([1, 9])
    return rows | {name: np.zeros(2, dtype=int) for name in KEYS if name in rows}


def expect(column, rows, how):
    """Return what a rule says of the two rows; the first stays."""
    older, newer = rows[column.name].tolist()
    expected = {
        "own": older,
        "sum": older + newer,
        "max": max(older, newer),
        "min": min(older, newer),
        "first": min(older, newer),
        "newest": newer,
        "known": newer,
    }
    if how == "mean":
        first, second = rows[column.merges.columns[0]].tolist()
        return (older * first + newer * second) / (first + second)
    if column.merges.most:
        return min(expected[how], expect_of(rows, column.merges.most))
    return expected[how]


def expect_of(rows, name):
    return max(rows[name].tolist()) if rows["same"] else sum(rows[name].tolist())


@pytest.mark.parametrize(("table", "column"), COLUMNS, ids=IDS)
def test_every_column_has_a_rule_that_is_followed(table, column):
    assert column.merges.how in MERGE_RULES
    declared = TABLES[table]
    for is_same in (False, True):
        rows = make_rows(declared)
        how = (is_same and column.merges.same_looks) or column.merges.how
        together = Groups(np.zeros(2, dtype=int), np.zeros(1, dtype=int))
        merged = merge_rows(declared, rows, together, same_looks=is_same)
        assert merged[column.name].tolist() == [expect(column, rows | {"same": is_same}, how)]


@pytest.mark.parametrize("column", OBJECTS, ids=lambda column: column.name)
def test_two_nodes_are_what_the_rule_says(column):
    rows = make_rows(OBJECTS)
    objects = make_table(OBJECTS)
    objects.append(2, **rows)
    fuse_objects(objects, np.zeros(2, dtype=int))
    merged = expect(column, rows, column.merges.how)
    assert objects[column.name].tolist() == [merged, rows[column.name][1]]


@pytest.mark.parametrize("column", EDGES, ids=lambda column: column.name)
def test_edges_of_two_nodes_are_what_the_rule_says(column):
    rows = make_rows(EDGES) | {"object": np.array([0, 1]), "is_true": np.array([True, False])}
    edges = make_table(EDGES)
    edges.append(2, **rows)
    fused, _ = fuse_edges(edges, np.zeros(2, dtype=int))
    how = column.merges.same_looks or column.merges.how
    assert fused[column.name].tolist() == [expect(column, rows | {"same": True}, how)]


@pytest.mark.parametrize(("table", "column"), COLUMNS, ids=IDS)
def test_two_pieces_of_furniture_are_what_the_rule_says(table, column):
    """And every column that speaks of furniture names the one that stays, or none."""
    if column.is_derived:
        return
    declared = list_written(table)
    rows = make_rows(declared)
    for other in declared:
        if other.refers_to == "furniture":
            rows[other.name] = np.array([0, 1])
    tables = {"furniture": make_rows(list_written("furniture")), table: rows}
    merged, _ = merge_places(tables, 0, 1)
    got = merged[table][column.name].tolist()
    if column.refers_to == "furniture":
        # What would come from where it is came from nowhere.
        assert set(got) == ({-1} if column.name == "came_from" else {0})
    elif table == "objects":
        assert got == rows[column.name].tolist()
    else:
        expected = expect(column, rows | {"same": False}, column.merges.how)
        assert got[0] == expected


NEW = Column("num_asked", text="questions about it", merges=SUM, splits="own")


@pytest.mark.parametrize(
    ("column", "message"),
    [
        (replace(NEW, text=""), r"num_asked of objects must have a text, got ''\. Say in a line"),
        (replace(NEW, merges=None), "num_asked of objects must say how it merges, got None. Give"),
        (replace(NEW, merges=Merge("most")), "must say how it merges, got Merge"),
        (
            replace(NEW, merges=Merge("newest", columns=("then",))),
            "by columns of its table, got Merge",
        ),
        (replace(NEW, merges=Merge("sum", most="num_asked")), "merge by columns of its table"),
        (
            replace(NEW, splits=""),
            r"num_asked of objects must say how it splits, got ''\. Give spl",
        ),
    ],
)
def test_a_column_without_a_rule_is_refused(column, message):
    check_columns({**TABLES, "objects": (*OBJECTS, NEW), "home": HOME})
    with pytest.raises(ValueError, match=message):
        check_columns({**TABLES, "objects": (*OBJECTS, column)})


@pytest.fixture
def memory():
    """A memory of a sink, a desk, a table and a shelf."""
    memory = SceneGraphMemory()
    room = memory.add_room("room")
    for label in ("sink", "desk", "table", "shelf"):
        memory.add_furniture(label, room)
    return memory


SINK, DESK, TABLE, SHELF = range(4)


def see(memory, *looks):
    for place, *names in looks:
        memory.observe(place, [Sighting(name) for name in names])
        memory.step()


def get_origin(batch, place):
    edges = batch.edges
    return edges["came_from"][(edges["furniture"] == place) & (edges["num_true"] > 0)].tolist()


@pytest.mark.parametrize("names", [("torch", "lamp"), ("lamp", "torch")])
def test_nodes_that_are_one_came_from_where_the_newer_did(memory, names):
    see(memory, (SINK, "torch"), (SHELF, "torch"), (DESK, "lamp"), (SHELF, "lamp", "torch"))
    see(memory, (SHELF, "lamp"))
    memory.merge(*names)
    assert get_origin(memory.batch.fuse(), SHELF) == [DESK]


def test_what_came_from_furniture_that_is_merged_came_from_the_other(memory):
    """And the moves between the two were none."""
    see(memory, (DESK, "mug"), (SHELF, "mug"), (TABLE, "mug"), (DESK, "mug"), (TABLE, "pen"))
    assert memory.batch.history.moves.sum() == 3
    memory.merge_furniture(TABLE, DESK)  # now the third is the shelf, the second the table
    assert memory.furniture_ids == (SINK, TABLE, SHELF)
    assert get_origin(memory.batch, 2) == [1]
    assert sorted(get_origin(memory.batch, 1)) == [-1, 2]
    moves = memory.batch.history.moves[0]
    assert np.argwhere(moves).tolist() == [[1, 2], [2, 1]]
    assert moves.sum() == memory.batch.history.counters["num_moved"][0] == 2


def test_looks_at_furniture_that_is_merged_are_all_kept(memory):
    see(memory, *([(DESK,), (TABLE,)] * 6))
    memory.merge_furniture(TABLE, DESK)
    times = memory.batch.history.look_times[0]
    assert sorted(times[1]) == [*range(4, 12)]
    see(memory, (TABLE,))
    assert sorted(memory.batch.history.look_times[0, 1]) == [*range(5, 13)]  # the oldest goes
    assert memory.batch.furniture_num_observed[0].tolist() == [0, 13, 0]


def test_what_was_said_of_furniture_that_is_merged_stays(memory):
    see(memory, (DESK, "mug"))
    memory.note_moved("keys", DESK, by="anna")
    memory.note_absent(DESK, "cup")
    memory.merge_furniture(TABLE, DESK)
    assert memory.last_seen("keys").furniture == TABLE
    assert memory.last_seen("keys").by == "anna"
    assert [place for _, place in memory._state.sought] == [TABLE]


def test_a_thing_that_is_split_off_has_what_its_edges_say(memory):
    see(memory, (DESK, "mug"), (SHELF, "mug"), (SHELF, "mug"))
    memory.split("mug", SHELF, "cup")
    objects = memory.batch.objects
    assert objects["num_observed"].tolist() == [1, 2]
    assert objects["last_observed"].tolist() == [0, 2]
    assert objects["last_furniture"].tolist() == [DESK, SHELF]
    assert objects["first_observed"].tolist() == [0, 0]

"""A memory that is made again from its log."""

import json
import sqlite3
from contextlib import closing, suppress

import pytest

from sgm.layout.box import Box
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import parse_rows, read_events, start_event
from sgm.memory.sighting import Sighting
from sgm.replay.replay import replay
from sgm.store.event import StoredEvent, insert_event
from sgm.store.home_reader import HomeReader
from simulator import SceneGraphMemory


def test_the_memory_is_what_it_was(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    kitchen, bath = memory.add_room("kitchen"), memory.add_room("bathroom")
    sink, table = memory.add_furniture("sink", kitchen), memory.add_furniture("table", kitchen)
    memory.observe(table, [Sighting("mug"), Sighting("spoon", "in", 0.9)])
    memory.step(3)
    memory.note_absent(sink, "mug")
    memory.observe(table, [], coverage=0.5)
    memory.move_furniture(table, bath, position=(1.0, 2.0))
    memory.remove_furniture(sink)
    shelf = memory.add_furniture("shelf", bath, "white shelf")
    memory.observe(shelf, [Sighting("mug")])
    memory.remove_object("spoon")
    *_, (again, _, furniture) = replay(read_events(tmp_path / "looks.sgm"))
    assert again.to_dict() == memory.to_dict()
    assert again.time == memory.time
    assert furniture[shelf] == shelf


def test_a_line_of_unknown_furniture_is_named(tmp_path):
    log = tmp_path / "looks.sgm"
    memory = SceneGraphMemory(path=log)
    memory.add_furniture("table", memory.add_room("kitchen"))
    memory.close()
    _write_events(log, [("look", 0, {"furniture": 7, "coverage": 1, "seen": []})])
    with pytest.raises(ValueError, match=r"every look of a memory must be of what was added, got"):
        list(replay(read_events(log)))


def _log_of_every_kind(path):
    memory = SceneGraphMemory(path=path)
    kitchen = memory.add_room("kitchen")
    fridge = memory.add_furniture("fridge", kitchen, None, (1, 2), open_cost=2.0)
    table = memory.add_furniture("table", kitchen, box=Box((1, 2, 0.5), (0.6, 1.2, 1), 0.3, "door"))
    seen = [Sighting("mug", "in", 0.9, id="a"), Sighting("mug", "in", id="b")]
    memory.observe(fridge, seen, {"in": 0.5, "onTop": 1}, ["vase"])
    memory.observe(table, [Sighting("plate", owner="anna", embedding=(1.0, 0.0))], 0.5)
    memory.note_absent(table, "spoon")
    memory.query("spoon")
    memory.step(2)
    memory.note_moved("spoon", table, by="anna")
    memory.picked_up("anna's plate")
    memory.put_down("anna's plate", fridge, "in")
    memory.rename("spoon", "tea spoon")
    memory.merge("a", "b")
    memory.split("b")
    memory.transform(0.3, (1, 2), "map 2")
    memory.move_furniture(table, kitchen, (1.0, 2.0))
    memory.forget("anna's plate")
    memory.remove_furniture(table)
    memory.remove_room(kitchen)


def _write_events(path, events):
    """Write events as another program would, with their checksums."""
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        (last,) = connection.execute("SELECT max(number) FROM events").fetchone()
        for number, (kind, time, arguments) in enumerate(events, last + 1):
            insert_event(connection, StoredEvent(number, time, kind, json.dumps(arguments), None))
        connection.execute("DELETE FROM snapshots WHERE event > 0")
        connection.execute("DELETE FROM snapshot_arrays WHERE event > 0")


def _list_paths(value, path=()):
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for name, one in items:
        yield from _list_paths(one if isinstance(one, dict | list) else (), (*path, name))


def _put(value, path, new):
    if not path:
        return new
    value = value.copy()
    value[path[0]] = _put(value[path[0]], path[1:], new)
    return value


@pytest.mark.slow
@pytest.mark.parametrize("odd", [None, True, 10**30, 1e999, "x", [], {"a": []}])
def test_an_odd_value_anywhere_is_understood_or_refused_in_a_line(tmp_path, odd):
    path = tmp_path / "looks.sgm"
    _log_of_every_kind(path)
    with HomeReader(path) as reader:
        start, rows = reader.read(from_first=True)
    content, num_refused = MemoryContent.from_snapshot(start), 0
    for at, row in enumerate(rows):
        arguments = json.loads(row.arguments)
        for place in _list_paths(arguments):
            changed = row._replace(arguments=json.dumps(_put(arguments, place, odd)))
            num_refused += 1
            with suppress(ValueError):  # and nothing else
                events = parse_rows([*rows[:at], changed, *rows[at + 1 :]], path)
                list(replay([start_event(content), *events]))
                num_refused -= 1
    assert num_refused > 50

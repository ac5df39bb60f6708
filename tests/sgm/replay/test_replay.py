"""A memory that is made again from its log."""

import json
import warnings
from contextlib import suppress

import pytest

from sgm.layout.box import Box
from sgm.memory.log_reader import read_log
from sgm.memory.sighting import Sighting
from sgm.replay.replay import replay
from simulator import SceneGraphMemory


def test_the_memory_is_what_it_was(tmp_path):
    memory = SceneGraphMemory(log=tmp_path / "looks.jsonl")
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
    *_, (again, _, furniture) = replay(read_log(tmp_path / "looks.jsonl"))
    assert again.to_dict() == memory.to_dict()
    assert again.time == memory.time
    assert furniture[shelf] == shelf


def test_a_memory_that_was_started_again_goes_on(tmp_path):
    log = tmp_path / "looks.jsonl"
    memory = SceneGraphMemory(log=log)
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    memory.observe(table, [Sighting("mug")])
    memory.save(tmp_path / "home.sgm")
    memory = SceneGraphMemory.load(tmp_path / "home.sgm", log=log)
    memory.step()
    memory.observe(table, [Sighting("mug"), Sighting("plate")])
    lines = read_log(log)
    assert [line.kind for line in lines].count("start") == 2
    seen = [memory.last_seen("mug") is not None for memory, _, _ in replay(lines)]
    assert seen.index(True) == len(seen) - seen[::-1].index(False)
    *_, (again, _, _) = replay(lines)
    assert again.to_dict() == memory.to_dict()


def test_a_line_of_unknown_furniture_is_named(tmp_path):
    log = tmp_path / "looks.jsonl"
    memory = SceneGraphMemory(log=log)
    memory.add_furniture("table", memory.add_room("kitchen"))
    with log.open("a") as file:
        file.write('{"kind":"look","time":0,"furniture":7,"coverage":1,"seen":[]}\n')
    with pytest.raises(ValueError, match=r"every look of a log must be of what was added, got 7"):
        list(replay(read_log(log)))


@pytest.mark.parametrize("content", [b"", b"\xff\x00 no log"])
def test_a_log_of_no_whole_line_is_refused(tmp_path, content):
    path = tmp_path / "looks.jsonl"
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the line that was cut off
        lines = read_log(path)
    with pytest.raises(ValueError, match=r"log must have a line, got none"):
        list(replay(lines))


def _log_of_every_kind(path):
    memory = SceneGraphMemory(log=path)
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
    path = tmp_path / "looks.jsonl"
    _log_of_every_kind(path)
    lines = path.read_text().splitlines()
    num_refused = 0
    for at, text in enumerate(lines):
        line = json.loads(text)
        for place in _list_paths(line):
            changed = json.dumps(_put(line, place, odd))
            path.write_text("\n".join([*lines[:at], changed, *lines[at + 1 :]]) + "\n")
            num_refused += 1
            with suppress(ValueError):  # and nothing else
                list(replay(read_log(path)))
                num_refused -= 1
    assert num_refused > 50

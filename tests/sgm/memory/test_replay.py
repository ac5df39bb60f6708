"""A memory that is made again from its log."""

import warnings

import pytest

from sgm.memory.look_log import read_log
from sgm.memory.replay import replay
from sgm.memory.sighting import Sighting
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

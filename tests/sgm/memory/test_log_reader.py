"""The log of a memory: what is written when, and what a crash leaves."""

import json
from datetime import datetime

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.log_reader import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian


@pytest.fixture
def path(tmp_path):
    return tmp_path / "looks.jsonl"


@pytest.fixture
def memory(path):
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20, 8), 600), log=path)
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", kitchen, "white fridge", position=(np.float64(1), 2))
    return memory


def test_every_change_is_a_line(memory, path):
    memory.observe(np.int64(0), [Sighting("milk", "in", 0.9)], coverage=0.5)
    memory.note_absent(0, "Butter")
    memory.step(3)
    memory.remove_object("milk")
    memory.move_furniture(0, memory.add_room("hall"))
    memory.remove_furniture(0)
    memory.remove_room(1)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["kind"] for line in lines] == (
        "start room furniture look absent step remove_object room move remove_furniture remove_room"
    ).split()
    assert lines[2]["position"] == [1.0, 2]
    assert lines[3] == {
        "kind": "look",
        "time": 0,
        "at": "2026-11-20T08:00:00",
        "furniture": 0,
        "coverage": 0.5,
        "seen": [["milk", "in", 0.9]],
    }
    assert (lines[5]["time"], lines[5]["at"]) == (3, "2026-11-20T08:30:00")
    assert [line.kind for line in read_log(path)] == [line["kind"] for line in lines]


def test_asking_and_what_is_refused_write_nothing(memory, path):
    before = path.read_bytes()
    finder = Finder(Bayesian())
    finder.rank(memory, "milk")
    finder.search(memory, "milk").next()
    memory.last_seen("milk")
    memory.step(0)
    with pytest.raises(ValueError, match="coverage"):
        memory.observe(0, [], coverage=0)
    with pytest.raises(KeyError):
        memory.observe(7, [])
    assert path.read_bytes() == before


def test_a_torn_last_line_is_left_out_and_told(memory, path):
    memory.observe(0, [Sighting("milk")])
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"kind":"look","time":0,"furn')
    with pytest.warns(UserWarning, match="was cut off, perhaps by a crash: 29 bytes are left out"):
        assert len(read_log(path)) == 4
    with pytest.warns(UserWarning, match="was cut off"):  # and the next memory goes on after it
        SceneGraphMemory(log=path)
    assert path.read_bytes().startswith(whole)
    assert [line.kind for line in read_log(path)][3:] == ["look", "start"]


def test_a_loaded_memory_says_how_the_home_is(memory, path, tmp_path):
    memory.step(5)
    memory.save(tmp_path / "home.sgm")
    SceneGraphMemory.load(tmp_path / "home.sgm", log=tmp_path / "new.jsonl")
    (line,) = read_log(tmp_path / "new.jsonl")
    layout = line.values["layout"]
    assert (line.kind, line.time, layout.room_labels) == ("start", 5, ("kitchen",))
    assert layout.furniture[0].description == "white fridge"
    assert line.values["clock"] == memory.clock


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("milk\n", "line 1 of a log must be one that SceneGraphMemory wrote, got JSONDecodeError"),
        ('{"kind":"step","time":1,"num_steps":1}\n', "'step' before any start"),
        ('{"kind":"dance","time":1}\n', "kind 'dance' at time 1"),
        (
            '{"kind":"start","time":0,"version":4,"clock":null,"rooms":[],"furniture":[]}\n',
            r"^log version must be 1, got 4 in .*looks\.jsonl\. Make it again",
        ),
        ("[1]\n", "TypeError"),
    ],
)
def test_another_file_is_refused_before_anything_is_written(path, text, message):
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        SceneGraphMemory(log=path)
    assert path.read_text() == text


def test_a_missing_file_or_folder(tmp_path):
    with pytest.raises(ValueError, match="log must be a file that can be read, got 'No such file"):
        read_log(tmp_path / "none.jsonl")
    with pytest.raises(TypeError, match=r"log must be a path, got .*SceneGraphMemory"):
        read_log(SceneGraphMemory())
    with pytest.raises(FileNotFoundError):
        SceneGraphMemory(log=tmp_path / "none" / "looks.jsonl")

"""A warning blames the line of the program that made the call, whatever the call goes through."""

import re
import warnings
from datetime import datetime
from pathlib import Path

import pytest

import sgm
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from tests.sgm.memory.sessions import CALLS

DESK, SHELF = range(2)
# A call of each name that writes into the log.
WRITING = {
    "add_room": lambda m: m.add_room("hall"),
    "rename_room": lambda m: m.rename_room(0, "hall"),
    "add_furniture": lambda m: m.add_furniture("bed", 0),
    "move_furniture": lambda m: m.move_furniture(DESK, position=(1, 2)),
    "name_furniture": lambda m: m.name_furniture(DESK, "table"),
    "merge_furniture": lambda m: m.merge_furniture(DESK, SHELF),
    "remove_room": lambda m: m.remove_room(0),
    "remove_furniture": lambda m: m.remove_furniture(SHELF),
    "remove_object": lambda m: m.remove_object("mug"),
    "observe": lambda m: m.observe(DESK, []),
    "note_absent": lambda m: m.note_absent(DESK, "mug"),
    "note_found": lambda m: m.note_found(DESK, "mug"),
    "query": lambda m: m.query("mug"),
    "note_moved": lambda m: m.note_moved("mug", SHELF, by="anna"),
    "picked_up": lambda m: m.picked_up("mug"),
    "put_down": lambda m: m.put_down("pen", SHELF),
    "rename": lambda m: m.rename("mug", "cup"),
    "merge": lambda m: m.merge("mug", "keys"),
    "split": lambda m: m.split("mug", SHELF, "cup"),
    "transform": lambda m: m.transform(1.0),
    "forget": lambda m: m.forget("mug"),
    "step": lambda m: m.step(),
    "step_to": lambda m: m.step_to(5),
    "start_clock": lambda m: m.start_clock(Clock(datetime(2026, 1, 5), 60)),
}


def find_blamed(call, words):
    """Return the file that the warnings of these words blame."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    (blamed,) = {one.filename for one in caught if words in str(one.message)}
    return blamed


@pytest.fixture
def memory(tmp_path):
    """A mug that was seen at both places, keys, and a pen in the robot's hand."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("study")
    for label in ("desk", "shelf"):
        memory.observe(memory.add_furniture(label, room), [Sighting("mug"), Sighting("keys")])
        memory.step()
    memory.picked_up("pen")
    return memory


def test_there_is_a_call_of_each_name():
    assert WRITING.keys() == CALLS.keys()


@pytest.mark.parametrize("name", WRITING)
def test_of_a_lost_file(memory, tmp_path, name):
    (tmp_path / "looks.sgm").unlink()
    assert find_blamed(lambda: WRITING[name](memory), "was moved or removed") == __file__


def test_of_a_file_that_was_lost_before_it_is_saved(memory, tmp_path):
    file = tmp_path / "looks.sgm"
    file.unlink()
    assert find_blamed(lambda: memory.save(file), "was moved or removed") == __file__


def test_of_frames_and_scores(memory):
    assert find_blamed(lambda: [memory.observe(DESK, []) for _ in range(11)], "few") == __file__
    doubted = [Sighting("mug", confidence=0.1)]
    assert find_blamed(lambda: memory.observe(SHELF, doubted), "confidences") == __file__


def test_all_warnings_of_the_package_are_made_so():
    folder = Path(sgm.__file__).parent
    sources = [path for path in folder.rglob("*.py") if path != folder / "messages.py"]
    texts = {path.name: path.read_text(encoding="utf-8") for path in sources}
    assert [
        name for name, text in texts.items() if re.search(r"warnings\.warn\b|stackl", text)
    ] == []

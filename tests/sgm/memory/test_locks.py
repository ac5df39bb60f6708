"""A memory file is saved by one process at a time, and a missing file is a FileNotFoundError."""

import os
import subprocess
import sys

import pytest

from sgm.finder.object_finder import ObjectFinder
from sgm.memory.log_reader import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory

SAVE = """
import sys
from sgm import SceneGraphMemory
memory = SceneGraphMemory()
memory.add_room("kitchen")
try:
    memory.save(sys.argv[1])
    print("saved", flush=True)
except ValueError as error:
    print(error, flush=True)
sys.stdin.readline()
"""
REFUSED = r"memory file must be saved by one process at a time, got another one at work for .*home"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no locks of open files: fcntl")


@pytest.fixture
def start(python):
    """What starts another process that saves a memory, and says what came of it."""
    started = []

    def begin(path):
        process = subprocess.Popen(
            [python, "-c", SAVE, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process, process.stdout.readline().strip()

    yield begin
    for process in started:
        if process.returncode is None:
            process.communicate("\n")


@pytest.mark.slow
def test_the_second_process_is_told(start, tmp_path):
    path = tmp_path / "home.sgm"
    process, said = start(path)
    assert said == "saved"
    memory = SceneGraphMemory.load(path)  # reading is free
    with pytest.raises(ValueError, match=REFUSED):
        memory.save(path)
    assert list(SceneGraphMemory.load(path).layout.rooms) == [0]
    memory.save(tmp_path / "other.sgm")
    process.communicate("\n")
    memory.add_room("hall")
    memory.save(path)  # who has ended locks nobody out
    memory.save(path)
    assert start(path)[1].startswith("memory file must be saved by one process at a time")
    assert sorted(os.listdir(tmp_path)) == ["home.sgm", "other.sgm"]  # nothing lies beside it


@pytest.mark.slow
def test_a_file_is_free_with_the_last_memory_that_saved_it(start, tmp_path):
    path = tmp_path / "home.sgm"
    memory, other = SceneGraphMemory(), SceneGraphMemory()
    memory.save(path)
    other.save(path)  # memories of one process may
    del memory
    assert start(path)[1].startswith("memory file must be saved by one process at a time")
    del other
    assert start(path)[1] == "saved"


@pytest.mark.slow
def test_a_file_that_another_process_put_in_its_place_is_told(start, tmp_path):
    path = tmp_path / "home.sgm"
    memory = SceneGraphMemory()
    memory.save(path)
    path.unlink()
    assert start(path)[1] == "saved"
    with pytest.raises(ValueError, match=REFUSED):
        memory.save(path)


def test_a_missing_file_is_found_missing(tmp_path):
    missing = tmp_path / "home.sgm"
    calls = (
        (lambda: SceneGraphMemory.load(missing), "memory file must be one that can be read, got"),
        (lambda: read_log(missing), "log must be a file that can be read, got"),
        (lambda: ObjectFinder.load(missing), "checkpoint must be a file that can be read"),
    )
    for call, message in calls:
        for kind in (FileNotFoundError, ValueError):
            with pytest.raises(kind, match=message) as caught:
                call()
        assert str(missing) in str(caught.value)
        assert "\n" not in str(caught.value)
    (tmp_path / "folder.sgm").mkdir()
    with pytest.raises(ValueError, match="memory file must be one that can be read") as caught:
        SceneGraphMemory.load(tmp_path / "folder.sgm")
    assert not isinstance(caught.value, FileNotFoundError)

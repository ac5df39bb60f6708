"""A file has one owner, by whatever name it is reached: links, other spellings, after a move."""

import gc
import os
import sqlite3
import subprocess
import sys
import time
import warnings
from contextlib import closing
from threading import Thread

import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.store.home_file import HomeFile

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="no locks of open files: fcntl"),
    pytest.mark.slow,  # each starts a process
]
OPEN = """
import sys, warnings
warnings.simplefilter("ignore")
from sgm import SceneGraphMemory
path, *calls = sys.argv[1:]
for how in calls:
    try:
        if how == "open":
            print("opened", SceneGraphMemory.open(path).num_furniture)
        elif how == "read":
            print("read", SceneGraphMemory.load(path).num_furniture)
        else:
            SceneGraphMemory().save(path)
            print("saved")
    except ValueError as error:
        print(error)
"""


@pytest.fixture
def home(tmp_path):
    """A home that is kept here, of one place."""
    (tmp_path / "a").mkdir()
    memory = SceneGraphMemory(path=tmp_path / "a" / "home.sgm")
    memory.add_furniture("table", memory.add_room("kitchen"))
    yield memory
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what a test has moved away
        memory.close()


def try_in_another_process(path, *calls: str, folder=None) -> list[str]:
    """What other owners are told, one call after the other."""
    done = subprocess.run(
        [sys.executable, "-c", OPEN, str(path), *calls],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def is_refused(said: list[str]) -> bool:
    return bool(said) and all("one process at a time" in line for line in said)


def link(home, tmp_path, way):
    """Return another path to the home, and the folder in which it means that."""
    path = home.path
    if way == "symbolic link":
        (tmp_path / "link.sgm").symlink_to(path)
        return tmp_path / "link.sgm"
    if way == "link to a link":
        (tmp_path / "first").symlink_to(path)
        (tmp_path / "link.sgm").symlink_to("first")
        return tmp_path / "link.sgm"
    if way == "linked folder":
        (tmp_path / "b").symlink_to(tmp_path / "a", target_is_directory=True)
        return tmp_path / "b" / "home.sgm"
    if way == "hard link":
        os.link(path, tmp_path / "link.sgm")
        return tmp_path / "link.sgm"
    if way == "dots":
        return f"{tmp_path}/a/../a/./home.sgm"
    if way == "relative":
        return "home.sgm"
    if way == "moved":
        return path.rename(tmp_path / "moved.sgm")
    path.parent.rename(tmp_path / "c")  # moved folder
    return tmp_path / "c" / "home.sgm"


WAYS = (
    "symbolic link",
    "link to a link",
    "linked folder",
    "hard link",
    "dots",
    "relative",
    "moved",
    "moved folder",
)


@pytest.mark.parametrize("way", WAYS)
def test_a_second_owner_is_refused(home, tmp_path, way):
    folder = home.path.parent if way == "relative" else tmp_path
    path = link(home, tmp_path, way)
    assert is_refused(try_in_another_process(path, "open", "save", folder=folder))


def test_to_read_is_free_and_who_has_ended_locks_nobody_out(home):
    path = home.path
    assert try_in_another_process(path, "read") == ["read 1"]
    home.close()
    home.step()  # it lives on alone
    assert try_in_another_process(path, "open", "save") == ["opened 1", "saved"]


def test_a_memory_that_is_gone_has_let_go(tmp_path):
    path = tmp_path / "home.sgm"
    memory = SceneGraphMemory(path=path)
    assert is_refused(try_in_another_process(path, "open"))
    del memory
    assert try_in_another_process(path, "open") == ["opened 0"]


def test_another_memory_of_this_process_is_not_saved_over_it(home, tmp_path):
    (tmp_path / "link.sgm").symlink_to(home.path)
    os.link(home.path, tmp_path / "hard.sgm")
    other = SceneGraphMemory()
    for path in (home.path, tmp_path / "link.sgm", tmp_path / "hard.sgm"):
        with pytest.raises(ValueError, match=r"must be saved by the memory that is kept in it"):
            other.save(path)
    home.save(home.path)
    home.save(tmp_path / "copy.sgm")
    other.save(tmp_path / "copy.sgm")  # no one has the copy
    assert is_refused(try_in_another_process(home.path, "save"))


def test_the_latest_to_open_a_home_has_it(home, tmp_path):
    again = SceneGraphMemory.open(home.path)
    again.step()
    with pytest.raises(ValueError, match=r"by one memory at a time, got one that is not"):
        home.step()
    assert home.time == 0
    home.save(tmp_path / "copy.sgm")  # what it knows is not lost
    del home
    assert is_refused(try_in_another_process(again.path, "open"))


def test_a_relative_path_is_of_the_folder_in_which_it_was_named(tmp_path, monkeypatch):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "a")
    memory = SceneGraphMemory(path="home.sgm")
    monkeypatch.chdir(tmp_path / "b")
    memory.step()
    memory.save(memory.path)
    memory.close()
    assert os.listdir(tmp_path / "b") == []
    assert SceneGraphMemory.load(tmp_path / "a" / "home.sgm").time == 1


@pytest.mark.parametrize("way", ["moved", "removed"])
def test_a_file_that_was_taken_away_is_begun_anew(home, tmp_path, way):
    home.observe(0, [Sighting("mug")])
    path, moved = home.path, tmp_path / "moved.sgm"
    path.rename(moved) if way == "moved" else path.unlink()
    with pytest.warns(UserWarning, match=r"the memory file was moved or removed: it is begun anew"):
        home.observe(0, [Sighting("keys")])
    home.close()
    again = SceneGraphMemory.load(path)
    assert again.last_seen("mug") is not None
    assert again.last_seen("keys") is not None
    if way == "moved":
        old = SceneGraphMemory.load(moved)
        assert (old.last_seen("mug") is None, old.last_seen("keys") is None) == (False, True)


def test_a_transaction_ends_in_the_file_in_which_it_began(home, tmp_path):
    path, moved = home.path, tmp_path / "moved.sgm"
    with home.transaction():
        home.observe(0, [Sighting("mug")])
        path.rename(moved)
        home.observe(0, [Sighting("keys")])
    with pytest.warns(UserWarning, match="begun anew"):
        home.observe(0, [Sighting("pen")])
    home.close()
    assert set(SceneGraphMemory.load(path).descriptions) == {"mug", "keys", "pen"}
    assert set(SceneGraphMemory.load(moved).descriptions) == {"mug", "keys"}


def test_who_opens_a_file_that_is_moved_in_a_transaction_has_it_after_that(
    home, tmp_path, monkeypatch
):
    """The one waited for the lock of the file, the other one for the right to hand it on."""
    moved, opened, caught = tmp_path / "moved.sgm", [], []
    other = Thread(target=lambda: opened.append(SceneGraphMemory.open(moved)), daemon=True)

    def look_for_it(file):
        lost = not file.is_in_place
        other.start()
        while file.is_held:
            time.sleep(0.001)
        return lost

    def write():
        with home.transaction():
            home.observe(0, [Sighting("mug")])
            home.path.rename(moved)
            monkeypatch.setattr(HomeFile, "is_lost", look_for_it)
            home.observe(0, [Sighting("keys")])
            monkeypatch.undo()
        if not other.ident:
            other.start()
        other.join()
        with pytest.raises(ValueError, match="by one memory at a time") as error:
            home.step()
        caught.append(error)

    writer = Thread(target=write, daemon=True)
    writer.start()
    writer.join(20)
    assert not writer.is_alive()
    assert caught
    assert set(opened[0].descriptions) == {"mug", "keys"}
    opened[0].close()


def test_a_copy_that_takes_its_place_holds_up_no_write(home, tmp_path, monkeypatch):
    def write_meanwhile(file):
        monkeypatch.undo()
        writer = Thread(target=home.step, daemon=True)
        writer.start()
        writer.join(20)
        assert not writer.is_alive()

    monkeypatch.setattr("sgm.store.new_file.os.fsync", write_meanwhile)
    home.parts.state.file.copy(tmp_path / "copy.sgm")
    assert SceneGraphMemory.load(tmp_path / "copy.sgm").time == 0
    assert home.time == 1


def test_nothing_is_written_to_another_file_in_its_place(home, tmp_path):
    home.path.rename(tmp_path / "moved.sgm")
    home.path.write_text("notes")
    for change in (home.step, lambda: home.save(home.path)):
        with pytest.raises(FileExistsError, match=r"memory file must stay where it was opened"):
            change()
    assert home.path.read_text() == "notes"
    assert home.time == 0
    home.path.unlink()
    with pytest.warns(UserWarning, match="begun anew"):
        home.step()


def test_events_of_another_program_are_found(home):
    """Where nothing locks files, the second one to write is told: numbers of events are its own."""
    with closing(sqlite3.connect(home.path)) as connection, connection:
        connection.execute("INSERT INTO events VALUES (3, 0, 'step', '{}', NULL, 0)")
    with pytest.raises(ValueError, match=r"one process at a time, got events of another one"):
        home.step()
    assert home.time == 0


def test_a_memory_that_the_collector_finds_in_a_circle_lets_go_of_its_file(tmp_path):
    path = tmp_path / "home.sgm"
    first = SceneGraphMemory(path=path)
    memory = SceneGraphMemory.open(path)  # younger than the open file, which is collected first
    memory.circle = [memory]
    del memory, first
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        gc.collect()
    assert said == []
    assert [file.name for file in tmp_path.iterdir()] == ["home.sgm"]
    with SceneGraphMemory.open(path) as again:
        assert again.num_furniture == 0

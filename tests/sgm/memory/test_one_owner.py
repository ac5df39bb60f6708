"""A file has one owner, by whatever name it is reached: links, other spellings, after a move."""

import os
import subprocess
import sys

import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.replay.kept_home import KeptHome

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="no locks of open files: fcntl"),
    pytest.mark.slow,  # each starts a process
]
OPEN = """
import sys, warnings
warnings.simplefilter("ignore")
from sgm import SceneGraphMemory
from sgm.replay.kept_home import KeptHome
path, *calls = sys.argv[1:]
for how in calls:
    try:
        if how == "keep":
            home = KeptHome.open(path)
            print("opened", home.memory.num_furniture)
        elif how == "save":
            SceneGraphMemory().save(path)
            print("saved")
        else:
            SceneGraphMemory(log=path)
            print("logged")
    except ValueError as error:
        print(error)
"""


@pytest.fixture
def home(tmp_path):
    """A home that is kept here, of one place; what was changed last is in its log."""
    (tmp_path / "a").mkdir()
    home = KeptHome.open(tmp_path / "a" / "home.sgm", is_new=True)
    home.memory.add_furniture("table", home.memory.add_room("kitchen"))
    return home


def end(home) -> None:
    """Let go of all that it has, as when its process ends."""
    home.memory = None


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
    assert is_refused(try_in_another_process(path, "keep", "save", folder=folder))


@pytest.mark.parametrize("way", ["hard link", "moved"])
def test_a_hard_link_or_a_moved_file_has_its_owner_after_a_snapshot(home, tmp_path, way):
    path = link(home, tmp_path, way)
    home.memory.step()
    home.snapshot()
    assert is_refused(try_in_another_process(path, "keep"))
    end(home)
    assert try_in_another_process(path, "keep") == ["opened 0"]  # as before the snapshot


@pytest.mark.parametrize("name", ["home.sgm.log", "home.sgm.log.lock", "home.sgm"])
def test_a_memory_is_not_saved_over_what_another_process_has(home, name):
    assert is_refused(try_in_another_process(home.path.with_name(name), "save"))


def test_a_linked_log_has_one_owner(home, tmp_path):
    (tmp_path / "link.jsonl").symlink_to(home.log)
    os.link(home.log, tmp_path / "hard.jsonl")
    for name in ("link.jsonl", "hard.jsonl"):
        assert is_refused(try_in_another_process(tmp_path / name, "log"))
    with pytest.raises(ValueError, match=r"log must have one name and one use"):
        SceneGraphMemory(log=tmp_path / "hard.jsonl")


def test_another_memory_of_this_process_is_not_saved_over_it(home, tmp_path):
    (tmp_path / "link.sgm").symlink_to(home.path)
    os.link(home.path, tmp_path / "hard.sgm")
    other = SceneGraphMemory()
    for path, message in (
        (home.path, r"must be saved by the memory that is kept in it"),
        (tmp_path / "link.sgm", r"must be saved by the memory that is kept in it"),
        (tmp_path / "hard.sgm", r"must have one name and one use"),
        (home.log, r"must have one name and one use"),
    ):
        with pytest.raises(ValueError, match=message):
            other.save(path)
    home.memory.save(home.path)
    home.memory.save(tmp_path / "copy.sgm")
    with pytest.raises(ValueError, match="kept in it"):  # a copy elsewhere gives up nothing
        other.save(home.path)
    assert is_refused(try_in_another_process(home.path, "save"))


def test_the_latest_to_keep_a_home_has_it(home):
    again = KeptHome.open(home.path)
    again.snapshot()
    with pytest.raises(ValueError, match="kept in it"):
        home.snapshot()
    with pytest.raises(ValueError, match="one memory at a time"):
        home.memory.step()


def test_a_link_keeps_one_log_beside_the_file(home, tmp_path):
    (tmp_path / "link.sgm").symlink_to(home.path)
    home.memory.observe(0, [Sighting("mug")])
    end(home)
    again = KeptHome.open(tmp_path / "link.sgm")
    assert again.path == home.path
    assert again.memory.last_seen("mug") is not None
    assert os.listdir(tmp_path) in (["a", "link.sgm"], ["link.sgm", "a"])


def test_a_relative_path_is_of_the_folder_in_which_it_was_named(tmp_path, monkeypatch):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "a")
    home = KeptHome.open("home.sgm", is_new=True)
    memory = SceneGraphMemory(log="looks.jsonl")
    monkeypatch.chdir(tmp_path / "b")
    home.memory.step()
    home.snapshot()
    memory.step()
    assert os.listdir(tmp_path / "b") == []
    assert (tmp_path / "a" / "looks.jsonl").read_text().count('"kind":"step"') == 1


@pytest.mark.parametrize("way", ["moved", "removed"])
def test_a_log_that_was_taken_away_is_begun_anew(home, tmp_path, way):
    home.memory.observe(0, [Sighting("mug")])
    moved = tmp_path / "moved.log"
    home.log.rename(moved) if way == "moved" else home.log.unlink()
    before = moved.read_bytes() if way == "moved" else b""
    with pytest.warns(UserWarning, match=r"the log was moved or removed: it is begun anew"):
        home.memory.observe(0, [Sighting("keys")])
    assert way == "removed" or moved.read_bytes() == before
    end(home)
    again = KeptHome.open(home.path)
    assert again.memory.last_seen("mug") is not None
    assert again.memory.last_seen("keys") is not None


def test_a_snapshot_begins_a_lost_log_anew(home):
    home.log.unlink()
    with pytest.warns(UserWarning, match="begun anew"):
        home.snapshot()
    end(home)
    assert KeptHome.open(home.path).memory.num_furniture == 1


def test_nothing_is_written_to_another_file_in_the_place_of_the_log(home, tmp_path):
    home.log.rename(tmp_path / "moved.log")
    home.log.write_text("notes")
    for change in (home.memory.step, home.snapshot):
        with pytest.raises(FileExistsError, match=r"log must stay where it was opened, got ano"):
            change()
    assert home.log.read_text() == "notes"
    assert home.memory.time == 0
    home.log.unlink()
    with pytest.warns(UserWarning, match="begun anew"):
        home.memory.step()


def test_a_snapshot_does_not_replace_another_file(home, tmp_path):
    home.path.rename(tmp_path / "moved.sgm")
    other = SceneGraphMemory()
    with pytest.raises(ValueError, match="kept in it"):
        other.save(home.path)
    home.path.write_text("notes")
    home.memory.step()
    with pytest.raises(FileExistsError, match=r"memory file must stay where it was opened, got a"):
        home.snapshot()
    assert home.path.read_text() == "notes"
    home.path.unlink()
    home.snapshot()
    assert SceneGraphMemory.load(home.path).time == 1


def test_hard_links_are_told(home, tmp_path):
    os.link(home.path, tmp_path / "backup.sgm")
    end(home)
    with pytest.warns(UserWarning, match=r"memory file has 2 names \(hard links\)"):
        KeptHome.open(home.path)

"""A file is the memory, wherever its process ended."""

import json
import signal
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing
from datetime import datetime

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory import memory_state
from sgm.memory.clock import Clock
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian
from sgm.replay.followed_memory import FollowedMemory
from sgm.replay.replay import replay

CLOCK = Clock(datetime(2026, 11, 16, 7, 30), step_seconds=600)
THINGS = ("mug", "large red mug", "keys", "milk")


def write(memory: SceneGraphMemory) -> str:
    """All that a memory holds, to the bit."""
    return json.dumps(memory.parts.state.get_content_to_save().to_json(), sort_keys=True)


def begin(path) -> SceneGraphMemory:
    memory = SceneGraphMemory.open(path, clock=CLOCK, is_new=True)
    kitchen = memory.add_room("kitchen")
    for label in ("fridge", "table", "shelf"):
        memory.add_furniture(label, kitchen)
    return memory


def change(memory: SceneGraphMemory, rng: np.random.Generator) -> None:
    """Make one random change."""
    place, thing = int(rng.integers(3)), str(rng.choice(THINGS))
    kind = rng.integers(8)
    if kind <= 1:
        seen = [Sighting(str(name), confidence=0.9) for name in rng.choice(THINGS, 2)]
        memory.observe(place, seen, coverage=1 / 3)
    elif kind == 2:
        memory.note_absent(place, thing)
    elif kind == 3:
        memory.step(int(rng.integers(3)))
    elif kind == 4:
        memory.query(thing)
    elif kind == 5:
        memory.transform(0.5, (1.0, 2.0))
    elif kind == 6:
        memory.note_moved("keys", place, by="anna")
    elif thing in memory.descriptions and rng.random() < 0.4:
        memory.remove_object(thing)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_it_goes_on_to_the_bit_wherever_it_ended(tmp_path, monkeypatch, seed):
    monkeypatch.setattr(memory_state, "MOST_NEW", 7)
    rng = np.random.default_rng(seed)
    path = tmp_path / "home.sgm"
    memory = begin(path)
    followed = FollowedMemory(path)
    for _ in range(60):
        change(memory, rng)
        kind = rng.random()
        if kind < 0.1:
            memory.save(path)
        elif kind < 0.25:  # another one of this process goes on
            before = write(memory)
            memory = SceneGraphMemory.open(path)
            assert write(memory) == before
        elif kind < 0.35:
            followed.catch_up()
            assert write(followed.memory) == write(memory)
            assert write(SceneGraphMemory.load(path)) == write(memory)
    before = write(memory)
    *_, (again, _, _) = replay(read_events(path))
    assert write(again) == before
    memory.save(tmp_path / "copy.sgm")
    followed.close()
    memory.close()
    for name in ("home.sgm", "copy.sgm"):
        assert write(SceneGraphMemory.load(tmp_path / name)) == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["copy.sgm", "home.sgm"]


def test_every_change_is_an_event(tmp_path):
    path = tmp_path / "home.sgm"
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20, 8), 600), path=path)
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", kitchen, "white fridge", position=(np.float64(1), 2))
    memory.observe(np.int64(0), [Sighting("milk", "in", 0.9)], coverage=0.5)
    memory.note_absent(0, "Butter")
    memory.step(3)
    memory.remove_object("milk")
    memory.move_furniture(0, memory.add_room("hall"))
    memory.remove_furniture(0)
    memory.remove_room(1)
    kinds = [event.kind for event in read_events(path)]
    assert kinds[0] == "start"
    assert " ".join(kinds[1:]) == (
        "room furniture look absent step remove_object room move remove_furniture remove_room"
    )
    with closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT number, time, arguments FROM events").fetchall()
    assert rows[1][:2] == (2, 0)
    assert json.loads(rows[1][2])["position"] == [1.0, 2]
    assert json.loads(rows[2][2]) == {
        "furniture": 0,
        "coverage": 0.5,
        "seen": [["milk", "in", 0.9]],
    }
    assert rows[4][:2] == (5, 3)


def test_asking_and_what_is_refused_write_nothing(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)
    before = len(read_events(path))
    finder = Finder(Bayesian())
    finder.rank(memory, "milk")
    finder.search(memory, "milk").next()
    memory.last_seen("milk")
    memory.step(0)
    with pytest.raises(ValueError, match="coverage"):
        memory.observe(0, [], coverage=0)
    with pytest.raises(KeyError):
        memory.observe(7, [])
    assert len(read_events(path)) == before


def fail_to_write(path, then):
    """Do something while files may have no more than some bytes, as on a full disk."""
    resource = pytest.importorskip("resource", reason="Windows has no limit of files")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(OSError, match=rf"must (take|be) .*got .* for {path}"):
            then()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_on_a_full_disk_nothing_is_changed(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)
    before = write(memory)

    def look_twice():
        with memory.transaction():
            memory.observe(0, [Sighting("milk")])
            memory.observe(1, [Sighting("mug")])

    for doing in (lambda: memory.observe(0, [Sighting("milk")]), look_twice):
        fail_to_write(path, doing)
        assert write(memory) == before
        assert write(SceneGraphMemory.load(path)) == before
    memory.observe(0, [Sighting("milk")])
    assert write(SceneGraphMemory.load(path)) == write(memory)


def test_a_start_on_a_full_disk_is_one_line(tmp_path):
    """What is known can be read; where nothing can be noted, the error says what to do."""
    path = tmp_path / "home.sgm"
    memory = begin(path)
    memory.observe(0, [Sighting("milk")])
    before = write(memory)
    memory.close()
    new = tmp_path / "new.sgm"
    fail_to_write(new, lambda: SceneGraphMemory(path=new))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["home.sgm"]

    def read():
        assert write(SceneGraphMemory.load(path)) == before
        SceneGraphMemory.open(path).step()

    fail_to_write(path, read)
    assert write(SceneGraphMemory.open(path)) == before


def test_a_transaction_is_seen_whole(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)
    with memory.transaction():
        memory.step()
        memory.observe(0, [Sighting("milk")])
        assert SceneGraphMemory.load(path).time == 0
    assert write(SceneGraphMemory.load(path)) == write(memory)

    def step_and_fail():
        with memory.transaction():
            memory.step()
            memory.observe(7, [])

    with pytest.raises(KeyError):
        step_and_fail()
    assert memory.time == 2  # what was made before the error stays, here and there
    assert write(SceneGraphMemory.load(path)) == write(memory)


def test_events_are_kept_up_to_a_size(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)
    file = memory.parts.files.file
    file.kept_bytes = 2000
    memory.observe(0, [Sighting("milk")])
    for number in range(12):
        for _ in range(10):
            memory.observe(1, [Sighting(f"thing {number}")])
            memory.step()
        memory.save(path)
    events = read_events(path)
    assert 10 < len(events) < 100
    assert events[0].kind == "start"
    assert events[0].values["memory"].time > 0
    *_, (again, _, _) = replay(events)
    assert write(again) == write(memory)
    assert write(SceneGraphMemory.load(path)) == write(memory)
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT count(*) FROM snapshots").fetchone()[0] <= 3
        # Of what was seen long ago, where it was seen last is there still.
        found = connection.execute("SELECT place FROM sightings WHERE thing = 'milk'").fetchall()
        assert found == [("fridge",)]


def test_a_clock_that_is_given_later_says_what_time_it_is_now(tmp_path):
    memory = SceneGraphMemory()
    memory.add_furniture("table", memory.add_room("kitchen"))
    memory.step(40)
    memory.save(tmp_path / "home.sgm")
    memory = SceneGraphMemory.open(tmp_path / "home.sgm", clock=CLOCK)
    assert memory.clock.get_time(40) == CLOCK.start  # step 40 is now, not 40 steps ahead
    memory.step_to(CLOCK.start)
    assert memory.time == 40
    memory.observe(0, [Sighting("mug")])
    again = SceneGraphMemory.open(tmp_path / "home.sgm", clock=Clock(datetime(2027, 1, 1)))
    assert again.clock == memory.clock
    assert write(again) == write(memory)


def test_a_missing_file_is_found_missing(tmp_path):
    missing = tmp_path / "home.sgm"
    calls = (
        (lambda: SceneGraphMemory.load(missing), "memory file must be one that can be read, got"),
        (lambda: SceneGraphMemory.open(missing), "memory file must be one that can be read, got"),
        (lambda: read_events(missing), "memory file must be one that can be read, got"),
        (lambda: ObjectFinder.load(missing), "checkpoint must be a file that can be read"),
    )
    for call, message in calls:
        for kind in (FileNotFoundError, ValueError):
            with pytest.raises(kind, match=message) as caught:
                call()
        assert str(missing) in str(caught.value)
        assert "\n" not in str(caught.value)
        if "memory file" in message:  # what to do where there is to be one
            assert "or begin one there: SceneGraphMemory(path=...) in Python, --new of" in str(
                caught.value
            )
    (tmp_path / "folder.sgm").mkdir()
    with pytest.raises(ValueError, match="memory file must be one that can be read") as caught:
        SceneGraphMemory.load(tmp_path / "folder.sgm")
    assert not isinstance(caught.value, FileNotFoundError)
    with pytest.raises(FileNotFoundError, match=r"folder of a memory file must exist"):
        SceneGraphMemory.open(tmp_path / "none" / "home.sgm", is_new=True)
    with pytest.raises(TypeError, match=r"memory file must be a path, got .*SceneGraphMemory"):
        read_events(SceneGraphMemory())


def test_a_new_memory_overwrites_nothing(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)
    before = write(memory)
    for _ in range(2):
        with pytest.raises(FileExistsError, match=r"memory file must be a new one.*\.open"):
            SceneGraphMemory(path=path)
        memory.close()
    assert write(SceneGraphMemory.load(path)) == before


@pytest.mark.filterwarnings("ignore:looks must be few in a time step")
def test_threads_write_one_file(tmp_path):
    path = tmp_path / "home.sgm"
    memory = begin(path)

    def look(thread):
        for number in range(20):
            memory.observe(thread, [Sighting(f"thing {thread} {number}")])
            memory.sync()

    threads = [threading.Thread(target=look, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(10):
        memory.save(path)
    for thread in threads:
        thread.join()
    assert write(SceneGraphMemory.load(path)) == write(memory)


@pytest.mark.slow
def test_a_fork_writes_nothing(tmp_path):
    code = """
import os, sys
from sgm import SceneGraphMemory
memory = SceneGraphMemory(path=sys.argv[1])
memory.add_room("kitchen")
child = os.fork()
if child == 0:
    try:
        memory.step()
    except ValueError as error:
        print(error, flush=True)
    sys.exit(0)
os.waitpid(child, 0)
memory.step()
memory.close()
"""
    path = tmp_path / "home.sgm"
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert "memory file must be written by the process that opened it" in done.stdout
    assert SceneGraphMemory.load(path).time == 1


def test_what_a_removed_file_has_left_is_not_read_into_a_new_one(tmp_path):
    path = tmp_path / "home.sgm"
    memory = SceneGraphMemory(path=path)
    memory.add_room("kitchen")
    with closing(sqlite3.connect(path)) as reader:
        assert reader.execute("SELECT label FROM rooms").fetchall() == [("kitchen",)]
        memory.close()
        path.unlink()  # what lies beside it stays, as someone still reads
        with SceneGraphMemory(path=path) as memory:
            memory.add_room("study")
    assert SceneGraphMemory.load(path).layout.room_labels == ("study",)

"""A snapshot and a log are the memory, wherever its process ended."""

import json
import signal
import subprocess
import sys
import threading
from datetime import datetime

import numpy as np
import pytest

from sgm.memory import look_log, memory_files
from sgm.memory.clock import Clock
from sgm.memory.log_reader import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.replay import kept_home
from sgm.replay.kept_home import KeptHome

CLOCK = Clock(datetime(2026, 11, 16, 7, 30), step_seconds=600)
THINGS = ("mug", "large red mug", "keys", "milk")


def write(memory: SceneGraphMemory) -> str:
    """All that a memory holds, to the bit."""
    return json.dumps(memory._state.get_content_to_save().to_json(), sort_keys=True)


def begin(path) -> KeptHome:
    home = KeptHome.open(path, CLOCK, is_new=True)
    kitchen = home.memory.add_room("kitchen")
    for label in ("fridge", "table", "shelf"):
        home.memory.add_furniture(label, kitchen)
    return home


def change(memory: SceneGraphMemory, rng: np.random.Generator) -> None:
    """Make one random change."""
    place, thing = int(rng.integers(3)), str(rng.choice(THINGS))
    kind = rng.integers(5)
    if kind <= 1:
        seen = [Sighting(str(name), confidence=0.9) for name in rng.choice(THINGS, 2)]
        memory.observe(place, seen, coverage=1 / 3)
    elif kind == 2:
        memory.note_absent(place, thing)
    elif kind == 3:
        memory.step(int(rng.integers(3)))
    elif memory.last_seen(thing) is not None and rng.random() < 0.2:
        memory.remove_object(thing)


@pytest.mark.parametrize("seed", range(6))
def test_it_goes_on_to_the_bit_wherever_it_ended(tmp_path, seed):
    rng = np.random.default_rng(seed)
    home = begin(tmp_path / "home.sgm")
    for _ in range(60):
        change(home.memory, rng)
        kind = rng.random()
        if kind < 0.1:
            home.snapshot()
        elif kind < 0.25:  # the process ends and another one begins
            before = write(home.memory)
            home = KeptHome.open(tmp_path / "home.sgm")
            assert write(home.memory) == before
    home.snapshot()
    assert write(SceneGraphMemory.load(tmp_path / "home.sgm")) == write(home.memory)


@pytest.mark.parametrize("ends_at", ["the new log", "the file"])
def test_a_process_that_ends_in_a_snapshot_loses_nothing(tmp_path, monkeypatch, ends_at):
    class Killed(BaseException):
        pass

    def end(*_):
        raise Killed

    home = begin(tmp_path / "home.sgm")
    home.memory.observe(0, [Sighting("milk")])
    home.snapshot()
    home.memory.step()
    home.memory.observe(1, [Sighting("mug")])
    before = write(home.memory)
    with monkeypatch.context() as patch:
        if ends_at == "the file":
            patch.setattr(memory_files, "save_content", end)
            with pytest.raises(Killed):
                home.snapshot()
        else:  # between the two names: the log is there under its number alone
            home.log.rename(home.log.with_name("home.sgm.log.000002"))
    home = KeptHome.open(tmp_path / "home.sgm")
    assert write(home.memory) == before
    home.memory.step()
    home.snapshot()
    assert write(KeptHome.open(tmp_path / "home.sgm").memory) == write(home.memory)


def test_a_full_disk_leaves_log_and_memory_as_they_were(tmp_path, monkeypatch):
    home = begin(tmp_path / "home.sgm")
    before, content = write(home.memory), home.log.read_bytes()

    def refuse(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("sgm.memory.look_log._append", refuse)
        with pytest.raises(OSError, match="No space"):
            home.snapshot()
    assert home.log.read_bytes() == content
    assert write(KeptHome.open(tmp_path / "home.sgm").memory) == before


@pytest.mark.parametrize("left", ["both", "file", "log"])
def test_a_start_on_a_full_disk(tmp_path, left):
    """What is known can be asked for; where nothing can be noted, the error says what to do."""
    resource = pytest.importorskip("resource", reason="Windows has no limit of files")
    path = tmp_path / "home.sgm"
    home = begin(path)
    home.memory.observe(0, [Sighting("milk")])
    if left == "file":
        home.snapshot()
        home.log.unlink()
    before = write(home.memory)
    if left == "log":
        path.unlink()
    home.memory = None

    clear = rf"disk must take \d+ bytes, got 'File too large' for {path}.*Free some space"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        if left == "file":
            with pytest.raises(OSError, match=clear):
                KeptHome.open(path)
        else:
            with pytest.warns(UserWarning, match=f"no snapshot was written at the start: {clear}"):
                home = KeptHome.open(path)
            assert home.memory.last_seen("milk") is not None
            with pytest.raises(OSError, match=clear):
                home.memory.observe(0, [Sighting("mug")])
            home.memory = None
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert write(KeptHome.open(path).memory) == before


def test_old_logs_may_be_removed_from_a_full_disk(tmp_path, monkeypatch):
    """As its message asks for: the file is of before the snapshot that the disk did not take."""
    path = tmp_path / "home.sgm"
    home = begin(path)
    home.snapshot()
    home.memory.step()

    def refuse(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(memory_files, "save_content", refuse)
        with pytest.raises(OSError, match="No space"):
            home.snapshot()
    home.memory.step()
    before = write(home.memory)
    for old in tmp_path.glob("home.sgm.log.0*"):
        old.unlink()
    home.memory = None
    assert write(KeptHome.open(path).memory) == before


def test_old_logs_are_kept_up_to_a_size(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_home, "KEPT_BYTES", 9000)
    monkeypatch.setattr(kept_home, "MOST_LOG_BYTES", 4000)
    home = begin(tmp_path / "home.sgm")
    for _ in range(4):
        while not home.is_log_long:
            home.memory.step()
        home.snapshot()
        assert not home.is_log_long
    ends = ("", ".log", ".log.000002", ".log.000003", ".log.000004", ".log.lock")
    assert sorted(file.name for file in tmp_path.iterdir()) == [f"home.sgm{end}" for end in ends]


def test_a_start_reads_one_memory_and_what_came_since(tmp_path):
    home = begin(tmp_path / "home.sgm")
    for _ in range(5):
        home.memory.step()
        home = KeptHome.open(tmp_path / "home.sgm")
        kinds = [line.kind for line in read_log(home.log)]
        assert kinds == ["start"]


def test_another_file_beside_a_log_is_refused(tmp_path):
    home = begin(tmp_path / "home.sgm")
    home.snapshot()
    other = SceneGraphMemory(clock=CLOCK)
    other.add_room("bath")
    del home
    other.save(tmp_path / "home.sgm")
    with pytest.raises(ValueError, match=r"home must be the memory that its log goes on from"):
        KeptHome.open(tmp_path / "home.sgm")


def test_a_file_without_a_log_begins_one_and_may_get_a_clock(tmp_path):
    memory = SceneGraphMemory()
    memory.add_furniture("table", memory.add_room("kitchen"))
    memory.save(tmp_path / "home.sgm")
    home = KeptHome.open(tmp_path / "home.sgm", CLOCK)
    assert home.memory.clock == CLOCK
    home.memory.observe(0, [Sighting("mug")])
    again = KeptHome.open(tmp_path / "home.sgm", Clock(datetime(2027, 1, 1)))
    assert again.memory.clock == CLOCK
    assert again.memory.last_seen("mug") is not None


def test_a_clock_that_is_given_later_says_what_time_it_is_now(tmp_path):
    memory = SceneGraphMemory()
    memory.add_furniture("table", memory.add_room("kitchen"))
    memory.step(40)
    memory.save(tmp_path / "home.sgm")
    home = KeptHome.open(tmp_path / "home.sgm", CLOCK)
    assert home.memory.clock.get_time(40) == CLOCK.start  # step 40 is now, not 40 steps ahead
    home.memory.step_to(CLOCK.start)
    assert home.memory.time == 40


def test_a_clock_for_a_log_without_one_says_what_time_it_is_now(tmp_path):
    home = KeptHome.open(tmp_path / "home.sgm", is_new=True)
    home.memory.step(40)
    del home
    again = KeptHome.open(tmp_path / "home.sgm", CLOCK)
    assert again.memory.clock.get_time(40) == CLOCK.start


def test_nothing_there_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"home must be a memory file or its log, got nei"):
        KeptHome.open(tmp_path / "home.sgm")
    with pytest.raises(FileNotFoundError, match=r"folder of a log must exist"):
        KeptHome.open(tmp_path / "none" / "home.sgm", is_new=True)


@pytest.mark.slow
def test_another_process_is_refused(tmp_path):
    home = begin(tmp_path / "home.sgm")
    home.snapshot()
    code = """
import sys
from sgm.replay.kept_home import KeptHome
from sgm.memory.log_reader import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory
path, log = sys.argv[1:]
for open_it in (lambda: KeptHome.open(path), lambda: SceneGraphMemory.load(path, log=log)):
    try:
        open_it()
    except ValueError as error:
        print(error)
"""
    command = [sys.executable, "-c", code, str(home.path), str(home.log)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 2
    assert all("log must be written by one process at a time" in line for line in lines)


def test_a_sync_finds_the_log_while_it_is_begun_anew(tmp_path, monkeypatch):
    """Between the old log and the new one there is none: a sync waits for it."""
    home = KeptHome.open(tmp_path / "home.sgm", is_new=True)
    append, failed, threads = look_log._append, [], []

    def sync():
        try:
            home.memory.sync_log()
        except OSError as error:
            failed.append(error)

    def append_late(path, content):
        threads.append(threading.Thread(target=sync))
        threads[-1].start()
        threads[-1].join(0.05)
        append(path, content)

    monkeypatch.setattr(look_log, "_append", append_late)
    home.snapshot()
    for thread in threads:
        thread.join(20)
    assert threads
    assert not failed

"""Files are read and written whole: pipes, devices, folders, links, kills, threads."""

import errno
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from nep.players.checkpoints import load_trained
from sgm.files import compute_checksum, read_file, read_json, write_whole
from sgm.memory.memory_event import read_events
from sgm.prior.prior_graph import PriorGraph
from simulator import SceneGraphMemory
from simulator.igridson.layout_file import load_layout
from simulator.snapshots.shards import load_shard
from simulator.trace.importers.scene_graph import load_label_names
from simulator.world.config import HomeConfig
from tools.priors.procthor_houses import count_procthor_houses
from tools.priors.table import count_table

ROOT = Path(__file__).parents[2]


def make_pipe(path):
    os.mkfifo(path)


def make_socket(path):
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(path))


ODD = {
    "pipe": make_pipe,
    "socket": make_socket,
    "folder": Path.mkdir,
    "device": lambda path: path.symlink_to("/dev/zero"),
}
READERS = {
    "read_file": read_file,
    "read_json": read_json,
    "checksum": compute_checksum,
    "memory": SceneGraphMemory.load,
    "log": read_events,
    "log to go on": lambda path: SceneGraphMemory(path=path),
    "prior": PriorGraph.load,
    "houses": count_procthor_houses,
    "table": count_table,
    "shard": load_shard,
    "labels": load_label_names,
    "layout": load_layout,
    "checkpoint": load_trained,
}


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_is_refused_at_once(reader, odd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the name of a socket has 107 characters
    ODD[odd](Path("odd"))
    signal.alarm(20)  # ends the test instead of waiting for ever
    try:
        with pytest.raises((OSError, ValueError), match=r"folder|a pipe, socket or device|file"):
            READERS[reader](Path("odd"))
    finally:
        signal.alarm(0)


@pytest.mark.parametrize("odd", ODD)
def test_what_is_no_file_is_not_written(odd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "odd"
    ODD[odd](Path("odd"))
    before = path.lstat()
    with pytest.raises(OSError, match=r"path must be one of a file, got .*odd\. Choose another"):
        write_whole(path, b"new")
    assert path.lstat().st_ino == before.st_ino
    assert os.listdir(tmp_path) == ["odd"]


def test_a_link_stays_and_what_it_names_is_written(tmp_path):
    (tmp_path / "disk").mkdir()
    link, target = tmp_path / "home.sgm", tmp_path / "disk" / "home.sgm"
    link.symlink_to(target)
    for content in (b"first", b"second"):  # also where there is no file yet
        write_whole(link, content)
        assert link.is_symlink()
        assert target.read_bytes() == content
    assert sorted(os.listdir(tmp_path)) == ["disk", "home.sgm"]
    assert os.listdir(tmp_path / "disk") == ["home.sgm"]
    around = tmp_path / "around"
    around.symlink_to(around)
    with pytest.raises(OSError, match="path must be one of a file, got"):
        write_whole(around, b"")


def test_what_a_killed_save_left_is_removed_by_the_next(tmp_path):
    """Two processes are stopped while they write one file, and killed."""
    code = """
import os, signal, sys
from pathlib import Path
import sgm.files as files
files.os.fsync = lambda descriptor: (print("writing", flush=True), signal.pause())
files.write_whole(Path(sys.argv[1]), b"half")
"""
    path = tmp_path / "home.sgm"
    path.write_bytes(b"old")
    writers = []
    for _ in range(2):
        command = [sys.executable, "-c", code, str(path)]
        writers.append(subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE))
        assert writers[-1].stdout.readline() == b"writing\n"
    assert len(os.listdir(tmp_path)) == 3
    write_whole(path, b"beside them")
    assert len(os.listdir(tmp_path)) == 3  # those who write still do
    for writer in writers:
        writer.kill()
        writer.communicate()
    assert path.read_bytes() == b"beside them"
    write_whole(path, b"new")
    assert os.listdir(tmp_path) == ["home.sgm"]
    assert path.read_bytes() == b"new"


def test_threads_that_write_one_file_leave_a_whole_one(tmp_path):
    path = tmp_path / "home.sgm"
    contents = [bytes([65 + number]) * 50_000 for number in range(6)]
    errors = []

    def write(content):
        try:
            for _ in range(20):
                write_whole(path, content)
                if path.read_bytes() not in contents:
                    errors.append("torn")
        except OSError as error:
            errors.append(str(error))

    threads = [threading.Thread(target=write, args=(content,)) for content in contents]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert os.listdir(tmp_path) == ["home.sgm"]


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (errno.EACCES, "folder must be writable, got .* change its permissions"),
        (errno.EROFS, "folder must be writable, got .*Read-only"),
        (errno.ENOSPC, r"disk must take 3 bytes, got .*Free some space and try"),
    ],
)
def test_what_hinders_a_save_is_said(number, message, tmp_path, monkeypatch):
    def refuse(descriptor):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("sgm.files.os.fsync", refuse)
    with pytest.raises(OSError, match=message):
        write_whole(tmp_path / "home.sgm", b"new")
    assert os.listdir(tmp_path) == []


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"folder of a file must exist, got .*deep/a\. Ma"):
        write_whole(tmp_path / "deep" / "a", b"")


def test_a_prior_is_saved_through_a_link(tmp_path):
    (tmp_path / "link.json").symlink_to(tmp_path / "prior.json")
    PriorGraph.default().save(tmp_path / "link.json")
    assert (tmp_path / "link.json").is_symlink()
    assert PriorGraph.load(tmp_path / "prior.json") == PriorGraph.default()


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(1 << 42)
    with pytest.raises(OSError, match="a file of 4398046511104 bytes, more than"):
        read_json(tmp_path / "sparse")


def test_a_home_has_no_more_places_than_can_be_made():
    with pytest.raises(ValueError, match="furniture_per_room must be at most 20000, got 100000"):
        HomeConfig(furniture_per_room=100_000)
    with pytest.raises(ValueError, match="furniture_x_objects_per_furniture must be at most"):
        HomeConfig(furniture_per_room=5000, objects_per_furniture=100)


def test_adjectives_of_a_prior_make_no_more_descriptions_than_can_be_listed():
    data = PriorGraph.default().to_dict()
    data["objects"][0] = {**data["objects"][0], "adjectives": [["x"]] * 8000}
    with pytest.raises(ValueError, match=r"objects\[0\]\.adjectives must .*at most 100000 comb"):
        PriorGraph.from_dict(data)
    rows = [{**row, "adjectives": [["x"]] * 16} for row in data["objects"]]
    with pytest.raises(ValueError, match="objects must have adjectives of at most 1000000"):
        PriorGraph.from_dict({**data, "objects": rows})

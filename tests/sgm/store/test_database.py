"""What people and tools see of a memory file: views, backups, checks, and where it may lie."""

import json
import os
import sqlite3
from contextlib import closing
from datetime import datetime

import pytest

from sgm import backup, check
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.store import connection as store_connection
from sgm.store.connection import find_network
from sgm.store.schema import SCHEMA


@pytest.fixture
def memory(tmp_path):
    memory = SceneGraphMemory(
        clock=Clock(datetime(2026, 11, 16, 8), 600), path=tmp_path / "home.sgm"
    )
    kitchen = memory.add_room("kitchen")
    for label in ("fridge", "table", "shelf"):
        memory.add_furniture(label, kitchen, position=(1, 2))
    memory.observe(1, [Sighting("keys", position=(1, 2, 3)), Sighting("red mug", id="m1")])
    memory.step(6)
    memory.note_moved("keys", 2, by="anna", relation="in")
    yield memory
    memory.close()


def ask(path, query):
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


def test_what_was_seen_said_and_moved_can_be_read_beside_the_writer(memory):
    path = memory.path
    assert ask(path, "SELECT thing, place, room, relation, x, z, at, tracker FROM sightings") == [
        ("keys", "table", "kitchen", "onTop", 1.0, 3.0, "2026-11-16 08:00:00", ""),
        ("red mug", "table", "kitchen", "onTop", None, None, "2026-11-16 08:00:00", "m1"),
    ]
    assert ask(path, "SELECT by, said, thing, place, confidence, at FROM statements") == [
        ("anna", "moved", "keys", "shelf", 0.9, "2026-11-16 09:00:00")
    ]
    assert ask(path, "SELECT thing, from_place, to_place, by FROM moves") == [
        ("keys", "table", "shelf", "anna")
    ]
    assert ask(path, "SELECT name, num_looks, last_look FROM places") == [
        ("fridge", 0, None),
        ("table", 1, 0),
        ("shelf", 0, None),
    ]


def test_tables_follow_what_is_changed(memory):
    path = memory.path
    memory.rename("keys", "car keys", "tom")
    memory.rename_room(0, "diner")
    memory.name_furniture(1, "desk", "oak desk")
    memory.move_furniture(0, position=(5, 6))
    memory.transform(0.0, (10.0, 0.0))
    memory.merge_furniture(2, 1)
    memory.remove_furniture(0)
    memory.forget("m1")
    assert ask(path, "SELECT thing, place, x FROM sightings WHERE thing = 'car keys'") == [
        ("car keys", "shelf", 11.0)
    ]
    assert ask(path, "SELECT name, is_known FROM things") == [("car keys", 1), ("red mug", 0)]
    assert ask(path, "SELECT name, x, is_there, num_looks FROM places") == [
        ("fridge", 15.0, 0, 0),
        ("oak desk", 11.0, 0, 1),
        ("shelf", 11.0, 1, 1),
    ]
    assert ask(path, "SELECT label FROM rooms") == [("diner",)]
    memory.observe(2, [Sighting("mug", id="m1")])
    assert ask(path, "SELECT is_known FROM things WHERE tracker = 'm1'") == [(0,), (1,)]


def test_a_saved_memory_says_what_it_knows(memory, tmp_path):
    memory.copy().save(tmp_path / "saved.sgm")
    for query in (
        "SELECT thing, place, relation, at FROM sightings ORDER BY thing",
        "SELECT by, said, thing, place, at FROM statements",
        "SELECT label, name, room, x, y, num_looks, last_look FROM places",
        "SELECT key, name, tracker FROM things ORDER BY key",
        "SELECT thing, from_place, to_place FROM moves",
    ):
        assert ask(tmp_path / "saved.sgm", query) == ask(memory.path, query), query


def write(memory):
    return json.dumps(memory.parts.state.get_content_to_save().to_json())


def test_a_backup_is_made_while_it_is_written(memory, tmp_path, capsys):
    out = tmp_path / "out.sgm"
    for _ in range(2):
        memory.observe(0, [Sighting("milk")])
        assert backup.main([str(memory.path), str(out)]) == 0
        assert write(SceneGraphMemory.load(out)) == write(memory)
    assert "backup: " in capsys.readouterr().out
    (tmp_path / "link.sgm").symlink_to(memory.path)
    for source, target, line in (
        (memory.path, memory.path, "backup must be another file than its home"),
        (memory.path, tmp_path / "link.sgm", "backup must be another file than its home"),
        (tmp_path / "none.sgm", out, "memory file must be one that can be read"),
        (memory.path, tmp_path / "none" / "out.sgm", "folder of a memory file must exist"),
    ):
        assert backup.main([str(source), str(target)]) == 1
        said = capsys.readouterr().err
        assert said.startswith(f"error: {line}")
        assert said.count("\n") == 1
    assert write(SceneGraphMemory.load(out)) == write(memory)


def test_a_check_says_what_is_wrong(memory, tmp_path, capsys):
    path, odd = str(memory.path), tmp_path / "odd.sgm"
    odd.write_text("notes")
    assert check.main([path]) == 0
    assert capsys.readouterr().out == f"{path}: ok\n"
    assert check.main([path, str(odd)]) == 1
    said = capsys.readouterr()
    assert said.out.count("\n") == said.err.count("\n") == 1
    memory.close()
    whole = bytearray(memory_bytes := (tmp_path / "home.sgm").read_bytes())
    place = memory_bytes.index(b"CREATE VIEW moves")
    whole[place + 1] ^= 1
    (tmp_path / "home.sgm").write_bytes(whole)
    assert check.main([path]) == 1
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ("UPDATE snapshots SET content = ' ' || content WHERE event = 0", "another checksum"),
        ("UPDATE snapshot_arrays SET numbers = x'01' WHERE event = 0", "another checksum"),
        ("UPDATE events SET arguments = arguments || ' ' WHERE number = 1", "no event 1 as it was"),
        ("DELETE FROM events WHERE number = 2", "no event 2 as it was written, but 3"),
        ("UPDATE home SET clock_start = '2026-11-16T09:00:00'", "home is not the one of the last"),
        ("UPDATE home SET prior = 'x'", "home is not the one of the last snapshot"),
    ],
)
def test_a_check_reads_what_no_start_needs(memory, capsys, change, line):
    """All snapshots and events that are kept, also those before the latest snapshot."""
    path = str(memory.path)
    memory.close()
    assert check.main([path]) == 0
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(change)
    SceneGraphMemory.load(path)
    assert check.main([path]) == 1
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1


def test_a_network_drive_is_refused(tmp_path, monkeypatch):
    mounts = tmp_path / "mountinfo"
    mounts.write_text(
        "1 0 8:1 / / rw - ext4 /dev/sda1 rw\n"
        f"2 1 0:9 / {tmp_path}/far rw,relatime shared:1 - nfs4 server:/homes rw\n"
        f"3 1 0:9 / {tmp_path}/farther rw - fuse.sshfs me@server: rw\n"
        f"4 2 8:2 / {tmp_path}/far/disk rw - ext4 /dev/sdb1 rw\n"
    )
    for folder, found in (
        ("far", "nfs4"),
        ("far/homes", "nfs4"),
        ("far/disk", ""),
        ("farther", "fuse.sshfs"),
        ("fart", ""),
    ):
        assert find_network(tmp_path / folder / "home.sgm", mounts) == found
    monkeypatch.setattr(store_connection, "find_network", lambda path: "nfs4")
    with pytest.raises(OSError, match=r"memory file must lie on a disk of this machine, got a net"):
        SceneGraphMemory(path=tmp_path / "home.sgm")


def test_a_file_that_cannot_be_written_can_be_read(memory, tmp_path, monkeypatch):
    before, path = write(memory), memory.path
    memory.close()
    path.chmod(0o444)
    path.parent.chmod(0o555)
    try:
        assert write(SceneGraphMemory.load(path)) == before
        if os.access(path, os.W_OK):  # who may do anything
            return
        with pytest.raises(OSError, match=r"folder must be writable|must be"):
            SceneGraphMemory.open(path)
    finally:
        path.parent.chmod(0o755)


def test_every_table_is_explained():
    """Who reads `.schema` finds in each table what its columns are."""
    for statement in SCHEMA:
        if statement.startswith("CREATE TABLE"):
            assert "--" in statement

"""Furniture that turns out to be another piece, or to be called otherwise."""

import numpy as np
import pytest

from sgm import SceneGraphMemory
from sgm.memory.memory_event import read_events
from sgm.memory.sighting import Sighting
from sgm.replay.replay import replay
from simulator.trace.from_log import make_trace


def make_memory(path=None):
    """A mug was seen at both, keys at the spot alone, a book at the table alone and last."""
    memory = SceneGraphMemory(path=path)
    room = memory.add_room("home")
    spot, table = memory.add_furniture("spot", room), memory.add_furniture("table", room)
    memory.observe(spot, [Sighting("mug"), Sighting("keys")])
    memory.step()
    memory.observe(table, [Sighting("mug"), Sighting("book")])
    memory.step()
    memory.observe(spot, [Sighting("mug"), Sighting("keys")])
    return memory, spot, table


def test_nothing_that_was_seen_is_lost():
    memory, spot, table = make_memory()
    memory.merge_furniture(table, spot)
    assert memory.furniture_ids == (table,)
    places = {name: memory.last_seen(name) for name in ("mug", "keys", "book")}
    assert {seen.furniture for seen in places.values()} == {table}
    assert {name: seen.time for name, seen in places.items()} == {"mug": 2, "keys": 2, "book": 1}
    edges = memory.batch.edges
    assert len(edges["object"]) == 3
    mug = memory.descriptions.index("mug")
    (row,) = np.flatnonzero(edges["object"] == mug)
    assert edges["num_true"][row] == 3  # two at the spot, one at the table
    memory.step()
    memory.observe(table, [])
    assert not memory.last_seen("keys").is_there


def test_a_name_is_corrected():
    memory, spot, table = make_memory()
    memory.name_furniture(spot, "desk", "white desk")
    assert memory.describe(spot) == "white desk in home"
    assert memory.layout.furniture[spot].label == "desk"
    assert memory.last_seen("keys").furniture == spot
    with pytest.raises(KeyError, match="furniture must be an id"):
        memory.name_furniture(9, "desk")
    with pytest.raises(ValueError, match="furniture label must be a non-empty text"):
        memory.name_furniture(spot, "")
    with pytest.raises(ValueError, match="must be two, got 1 twice"):
        memory.merge_furniture(table, table)
    with pytest.raises(KeyError, match="furniture must be an id"):
        memory.merge_furniture(table, 9)
    assert memory.num_furniture == 2


def test_logs_traces_and_files_carry_both(tmp_path):
    memory, spot, table = make_memory(tmp_path / "looks.sgm")
    memory.name_furniture(table, "dining table")
    memory.merge_furniture(table, spot)
    memory.step()
    memory.observe(table, [Sighting("mug")])
    lines = read_events(tmp_path / "looks.sgm")
    again = list(replay(lines))[-1][0].copy()
    memory.save(tmp_path / "one.sgm")
    again.observe(table, [Sighting("mug")])
    assert again.layout == memory.layout
    loaded = SceneGraphMemory.load(tmp_path / "one.sgm")
    assert loaded.last_seen("keys").furniture == table
    trace = make_trace(lines)
    used = {event.furniture for event in trace.events if event.furniture >= 0}
    assert [trace.layout.furniture[number].label for number in used] == ["dining table"]

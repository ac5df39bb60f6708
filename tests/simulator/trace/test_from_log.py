"""A trace from a log: every rule by hand, and what replays it."""

import math
from datetime import datetime

import pytest

from sgm.layout.box import Box
from sgm.memory.clock import Clock
from sgm.memory.memory_event import MemoryEvent, read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from simulator.trace.__main__ import main
from simulator.trace.events import GONE
from simulator.trace.from_log import make_trace, split_trace
from simulator.trace.source import RecordedSource
from simulator.trace.trace import load_trace

DESK, SHELF, BED = 0, 1, 2
HOUR = 3600.0


@pytest.fixture
def path(tmp_path):
    return tmp_path / "looks.sgm"


@pytest.fixture
def memory(path):
    return make_home(path)


def make_home(path, **options) -> SceneGraphMemory:
    memory = SceneGraphMemory(path=path, **options)
    study, bedroom = memory.add_room("study"), memory.add_room("bedroom")
    for label, room in (("desk", study), ("shelf", study), ("bed", bedroom)):
        memory.add_furniture(label, room)
    return memory


def look(memory, place, *seen, coverage=1.0):
    memory.observe(place, [Sighting(thing) for thing in seen], coverage)


def list_events(path):
    return [
        (event.time_s / HOUR, event.object, event.furniture)
        for event in make_trace(read_events(path)).events
    ]


def test_a_thing_is_where_it_was_seen_until_it_is_seen_elsewhere(memory, path):
    look(memory, DESK, "mug", "pen")
    memory.step(2)
    look(memory, SHELF, "mug")  # nobody has looked at the desk since
    memory.step()
    look(memory, SHELF, "mug")  # nothing new
    assert list_events(path) == [(0, "mug", DESK), (0, "pen", DESK), (2, "mug", SHELF)]


def test_seen_absent_is_open_until_it_is_seen_again(memory, path):
    look(memory, DESK, "mug", "pen")
    memory.step()
    look(memory, DESK, "pen")
    memory.step()
    look(memory, BED)
    memory.step()
    look(memory, DESK, "mug", "pen")
    assert list_events(path)[2:] == [(1, "mug", GONE), (3, "mug", DESK)]


def test_absent_and_elsewhere_in_one_step_is_one_move(memory, path):
    look(memory, DESK, "mug")
    memory.step()
    look(memory, SHELF, "mug")
    look(memory, DESK)
    memory.step()
    look(memory, SHELF)
    look(memory, BED, "mug")
    source = RecordedSource.from_traces([make_trace(read_events(path))], step_seconds=HOUR)
    assert source.episodes[0].num_moves.tolist() == [1, 1]


def test_parts_of_looks_count_until_they_make_half_of_one(memory, path):
    look(memory, DESK, "mug", "pen")
    memory.step()
    look(memory, DESK, coverage=0.3)
    memory.step()
    look(memory, DESK, "pen", coverage=0.3)  # .6 without the mug; the pen was seen again
    assert list_events(path)[2:] == [(2, "mug", GONE)]


def test_positions_are_where_a_thing_was_first_seen_there_in_the_last_map(path):
    """A quarter turn takes (1, 2) to (-2, 1), and the shift by (5, 0) to (3, 1)."""
    memory = SceneGraphMemory(path=path)
    room = memory.add_room("kitchen")
    box = Box((1.0, 2.0, 0.4), (0.8, 1.0, 0.8))
    table, shelf = (memory.add_furniture(name, room, box=box) for name in ("table", "shelf"))
    memory.observe(table, [Sighting("mug", position=(1, 2, 0.8)), Sighting("cup")])
    memory.step()
    memory.observe(table, [Sighting("mug", position=(1.2, 2, 0.8)), Sighting("cup")])
    memory.transform(math.pi / 2, (5.0, 0.0))
    memory.step()
    memory.observe(table, [Sighting("cup")])
    memory.observe(shelf, [Sighting("mug", "in", position=(6, 6, 0.5))])
    trace = make_trace(read_events(path))
    there = [event for event in trace.events if event.furniture != GONE]
    positions = [event.position for event in there if event.object == "mug"]
    assert positions == [pytest.approx((3, 1, 0.8)), pytest.approx((6, 6, 0.5))]
    assert [event.position for event in trace.events if event.object == "cup"] == [None]
    drawn = trace.layout.furniture[0].box
    assert drawn.center == pytest.approx((3, 1, 0.4))
    assert drawn.yaw == pytest.approx(math.pi / 2)


def test_a_look_for_one_thing_says_nothing_of_others(memory, path):
    look(memory, DESK, "mug", "pen")
    memory.step()
    memory.note_absent(DESK, "the Mug")
    assert list_events(path)[2:] == [(1, "mug", GONE)]


def test_of_a_kind_there_are_as_many_as_were_seen_in_one_step(memory, path):
    look(memory, DESK, "plate", "plate")
    memory.step()
    look(memory, DESK, "plate")  # one has left
    look(memory, SHELF, "plate")  # and is here: no third one
    memory.step()
    look(memory, BED, "plate", "plate", "plate")
    assert list_events(path)[2:] == [
        (1, "plate 2", GONE),
        (1, "plate 2", SHELF),
        (2, "plate", BED),
        (2, "plate 2", BED),
        (2, "plate 3", BED),
    ]


def test_what_is_doubtful_forgotten_or_removed(memory, path):
    memory.observe(DESK, [Sighting("mug", confidence=0.4), Sighting("pen"), Sighting("ghost")])
    look(memory, BED, "book")
    memory.remove_object("ghost")
    memory.step()
    memory.move_furniture(BED, room=0)
    memory.remove_furniture(DESK)
    trace = make_trace(read_events(path))
    assert list_events(path) == [(0, "pen", DESK), (0, "book", BED), (1, "pen", GONE)]
    assert [row.room for row in trace.layout.furniture.values()] == [0, 0, 0]


def test_a_memory_goes_on_in_its_file(path):
    """Opened again: the same furniture, and time goes on."""
    memory = make_home(path)
    look(memory, DESK, "mug")
    memory = SceneGraphMemory.open(path)
    memory.step(4)
    look(memory, SHELF, "mug")
    assert list_events(path) == [(0, "mug", DESK), (4, "mug", SHELF)]
    assert len(make_trace(read_events(path)).layout.furniture) == 3


def test_clocks_say_how_much_later(path):
    look(make_home(path, clock=Clock(datetime(2026, 11, 20, 8), 600)), DESK, "mug")
    later = path.with_name("later.sgm")
    memory = make_home(later, clock=Clock(datetime(2026, 11, 21, 8), 600))
    memory.step(3)
    look(memory, BED, "mug")
    trace = make_trace([*read_events(path), *read_events(later)])
    assert [(event.time_s / HOUR, event.furniture) for event in trace.events] == [
        (0, DESK),
        (24.5, BED),
    ]
    assert trace.start == datetime(2026, 11, 20, 8)


def test_the_command_cuts_by_time_and_what_it_writes_replays(memory, path, tmp_path, capsys):
    for step in range(50):
        look(memory, step % 3, "mug", "desk lamp")
        memory.step()
    assert main(["from-log", str(path), "--out", str(tmp_path / "home")]) == 0
    assert "3 furniture nodes, 2 objects" in capsys.readouterr().out
    parts = [load_trace(tmp_path / "home" / name) for name in ("train", "val", "test")]
    # 49 hours: .6, .2, .2 of them
    assert [part.end_s / HOUR for part in parts] == pytest.approx([29.4, 39.2, 49])
    assert [part.start_s / HOUR for part in parts] == pytest.approx([0, 29.4, 39.2])
    assert RecordedSource(folders=[str(tmp_path / "home")]).num_homes == 3


@pytest.mark.parametrize("shares", [(-0.1, 0.2), (0.5, 0.5)])
def test_shares_must_leave_something(memory, path, shares):
    look(memory, DESK, "mug")
    with pytest.raises(ValueError, match=r"must be 0 or more and leave some time.*Take 0\.2"):
        split_trace(make_trace(read_events(path)), dict(zip(("val", "test"), shares, strict=True)))


def test_a_log_without_sightings_is_refused(memory, path):
    look(memory, DESK)
    with pytest.raises(ValueError, match="must hold a sighting, got 1 looks without one"):
        make_trace(read_events(path))


def test_a_line_that_names_no_furniture_is_refused(memory, path):
    row = {"furniture": 9, "coverage": (1.0, 1.0), "seen": [], "hidden": []}
    events = [*read_events(path), MemoryEvent("look", 0, row)]
    with pytest.raises(ValueError, match="must be of furniture that was added, got 9"):
        make_trace(events)


def test_what_people_say_and_the_robot_does_moves_things(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    table, shelf, sink = (memory.add_furniture(label, room) for label in ("table", "shelf", "sink"))
    memory.observe(table, [Sighting("cup"), Sighting("fork")])
    memory.step()
    memory.note_moved("cup", shelf, by="anna")
    memory.picked_up("fork")
    memory.step()
    memory.put_down("fork", sink, "in")
    trace = make_trace(read_events(tmp_path / "looks.sgm"), "home")
    assert [(e.time_s, e.object, e.furniture, e.relation) for e in trace.events] == [
        (0, "cup", table, 1),
        (0, "fork", table, 1),
        (3600, "cup", shelf, 0),
        (7200, "fork", sink, 0),
    ]

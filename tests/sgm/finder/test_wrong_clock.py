"""A service on a machine whose clock is wrong: steps go on, and it is said everywhere."""

import json
from datetime import datetime, timedelta

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.replay.replay import replay

START = datetime(2026, 11, 16, 8)
MINUTE, DAY = timedelta(minutes=1), timedelta(days=1)


class Machine:
    """A machine whose clock says what it is set to."""

    def __init__(self, path):
        self.wall, self.log = START, path / "looks.sgm"
        memory = SceneGraphMemory(clock=Clock(START, 600), path=self.log)
        self.table = memory.add_furniture("table", memory.add_room("kitchen"))
        self.memory = memory
        self.service = MemoryService(memory, Finder(Adaptive()), lambda: self.wall)

    def look(self, wall, *things):
        self.wall = wall
        return self.service.observe(self.table, [Sighting(thing) for thing in things])


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


@pytest.mark.parametrize("wrong", [20 * DAY, timedelta(hours=1), timedelta(hours=7)])
def test_one_wrong_reading_does_not_freeze_a_memory(machine, wrong):
    """All looks of the next twenty days fell into one step: "97 %, seen here in this step"."""
    right = START + DAY
    machine.look(right + wrong, "mug")
    ahead = machine.memory.time
    with pytest.warns(UserWarning, match="the clock of the machine went back: it says 2026-11-17"):
        noted = machine.look(right + 10 * MINUTE)
    assert "went back" in noted.clock_fault
    times = []
    for number in range(2, 30):
        noted = machine.look(right + number * 10 * MINUTE)
        times.append(machine.memory.time)
    assert times == list(range(ahead + 1, ahead + 29))
    assert "whose steps go on from there" in noted.clock_fault
    places = machine.service.where_is("mug").places
    assert all(place.probability < 0.5 for place in places)
    assert not machine.memory.last_seen("mug").is_there


def test_the_log_has_what_the_clock_said_and_replays_alike(machine):
    machine.look(START + 20 * DAY, "mug")
    with pytest.warns(UserWarning, match="went back"):
        machine.look(START + MINUTE, "pen")
    machine.look(START + 31 * MINUTE, "pen")
    lines = read_events(machine.log)
    walls = [line.values["wall"] for line in lines if "wall" in line.values]
    assert walls == ["2026-11-16T08:01:00"]
    *_, (memory, _, _) = replay(lines)
    assert json.dumps(memory.to_dict()) == json.dumps(machine.memory.to_dict())


def test_a_restart_with_the_right_time_goes_on(machine):
    machine.look(START + 20 * DAY, "mug")
    before = machine.memory.time
    machine.wall = START
    with pytest.warns(UserWarning, match="went back"):
        other = MemoryService(machine.memory, Finder(Adaptive()), lambda: machine.wall)
    machine.wall = START + 60 * MINUTE
    assert other.let_time_pass() == 6
    assert machine.memory.time == before + 6


def test_nothing_is_said_of_a_clock_that_is_right(machine):
    for number in range(5):
        assert machine.look(START + number * DAY, "mug").clock_fault == ""
    assert machine.service.clock_fault == ""
    assert not any("wall" in event.values for event in read_events(machine.log))


def test_a_month_ahead_is_said_and_not_believed(machine):
    with pytest.warns(UserWarning, match="was set ahead: it says 2027-01-15T08:00:00"):
        noted = machine.look(START + 60 * DAY, "mug")
    assert (noted.at.step, machine.memory.time) == (0, 0)
    assert "More than 31 days are not believed" in noted.clock_fault
    assert machine.look(START + MINUTE, "mug").clock_fault == ""
    assert machine.look(START + 10 * MINUTE).at.step == 1
    machine.wall = START + 60 * DAY
    with pytest.raises(ValueError, match="at most 31 days after the present step"):
        MemoryService(machine.memory, Finder(Adaptive()), lambda: machine.wall)


QUESTIONS = {
    "where_is": ("mug",),
    "ask": ("where is the mug?",),
    "list_things": (),
    "list_places": (),
    "history": ("mug",),
    "changes": (0,),
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_a_quiet_night_has_passed_when_the_first_question_comes(machine, name):
    machine.look(START, "mug")
    machine.wall = START + timedelta(hours=11)
    getattr(machine.service, name)(*QUESTIONS[name])
    assert machine.memory.time == 66
    assert "seen here at 8:00" in machine.service.where_is("mug").places[0].why
    number = len(read_events(machine.log))
    getattr(machine.service, name)(*QUESTIONS[name])  # in the same step
    assert len(read_events(machine.log)) == number


def test_what_is_asked_on_a_full_disk_is_answered(machine, monkeypatch):
    machine.look(START, "mug")
    machine.wall = START + timedelta(hours=11)

    def write(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(machine.memory.parts.state.file, "append", write)
    assert machine.service.where_is("mug").places
    assert machine.memory.time == 0


@pytest.mark.parametrize("wrong", [timedelta(minutes=11), timedelta(hours=7), 20 * DAY, 60 * DAY])
def test_a_clock_that_is_ahead_for_a_moment_moves_no_memory(machine, wrong):
    """An even clock says what has passed; the mug is taken away meanwhile."""
    even = [0.0]
    machine.service = MemoryService(
        machine.memory, Finder(Adaptive()), lambda: machine.wall, monotonic=lambda: even[0]
    )

    def look(minutes, wrong, *things):
        even[0] = 60.0 * minutes
        return machine.look(START + minutes * MINUTE + wrong, *things)

    look(0, timedelta(0))
    with pytest.warns(UserWarning, match="the clock of the machine was set ahead"):
        noted = look(1, wrong, "mug")
    assert "was set ahead" in noted.clock_fault
    assert "was set ahead" in machine.service.clock_fault
    assert look(2, wrong, "mug").at.step == 0
    assert look(3, timedelta(0)).clock_fault == ""
    assert [look(minutes, timedelta(0)).at.step for minutes in (9, 10, 40)] == [0, 1, 4]
    assert not machine.memory.last_seen("mug").is_there
    *_, (memory, _, _) = replay(read_events(machine.log))
    assert json.dumps(memory.to_dict()) == json.dumps(machine.memory.to_dict())

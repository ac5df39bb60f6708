"""What time it is in a home: seconds of the week by hand, and memories that keep their clock."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sgm.arrays.week import compute_week_seconds
from sgm.finder.finder import Finder
from sgm.memory.clock import make_clock_rows
from sgm.policies import Adaptive
from sgm.store.home_reader import HomeReader
from sgm.store.snapshot import write_snapshot
from simulator import Clock, PriorGraph, SceneGraphMemory, Sighting
from simulator.snapshots.snapshots import forget
from simulator.snapshots.taken import take_snapshots

MONDAY = datetime(2026, 11, 16, 7, 30)
HOUR = 3600


def test_seconds_of_the_week_by_hand():
    # Monday 07:30 is 7.5 h into the week; Thursday 00:00:01 is 3 x 86400 + 1 s.
    assert Clock(MONDAY, 600).row == (7.5 * HOUR, 600)
    assert Clock(datetime(2026, 11, 19, 0, 0, 1)).row == (259_201, HOUR)
    rows = make_clock_rows([Clock(MONDAY, 600), None, Clock(datetime(2026, 11, 22, 23), HOUR)])
    # 27000 + 6 x 600; unknown; Sunday 23:00 and one hour is Monday 00:00, two hours 01:00.
    found = compute_week_seconds(rows[[0, 1, 2, 2]], np.array([6, 6, 1, 2]))
    np.testing.assert_array_equal(found, [30_600, np.nan, 0, HOUR])
    assert make_clock_rows([None, None]) is None


@given(
    st.datetimes(datetime(1990, 1, 1), datetime(2100, 1, 1)),
    st.integers(1, 10**5),
    st.integers(0, 10**5),
)
def test_every_step_is_what_a_calendar_says(start, step_seconds, time):
    start = start.replace(microsecond=0)
    clock = Clock(start, step_seconds)
    now = start + timedelta(seconds=time * step_seconds)
    expected = ((now.weekday() * 24 + now.hour) * 60 + now.minute) * 60 + now.second
    assert compute_week_seconds(make_clock_rows([clock]), np.array([time])) == [expected]
    shifted = clock.shift(time * step_seconds)
    assert shifted.row == (expected, step_seconds)
    assert Clock.from_json(json.loads(json.dumps(shifted.to_json()))) == shifted


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (("07:30",), TypeError, r"start must be a datetime, got '07:30'. Write datetime\(2026"),
        ((MONDAY.date(),), TypeError, r"start must be a datetime, got datetime.date\(2026, 11, 16"),
        ((MONDAY.replace(tzinfo=timezone.utc),), ValueError, r"got the time zone of .*\+00:00'"),
        ((MONDAY, 0), ValueError, "step_seconds must be a number > 0, got 0. Take 3600"),
        ((MONDAY, float("nan")), ValueError, "step_seconds must be a number > 0, got nan"),
        ((MONDAY, "60"), TypeError, "step_seconds must be a number, got '60'"),
    ],
)
def test_what_is_no_clock(values, error, message):
    with pytest.raises(error, match=message):
        Clock(*values)


def test_a_date_that_is_none_any_more():
    with pytest.raises(ValueError, match=r"before the year 10000, got 1e\+12 s after 2026-11-16"):
        Clock(MONDAY).shift(1e12)


@pytest.fixture
def memory() -> SceneGraphMemory:
    """A desk on which a mug was seen at Monday 08:30, half an hour ago."""
    memory = SceneGraphMemory(clock=Clock(MONDAY, 1800))
    desk = memory.add_furniture("desk", room=memory.add_room("study"))
    memory.step(2)
    memory.observe(desk, [Sighting("mug")])
    memory.step()
    return memory


def test_a_memory_keeps_its_clock(memory, tmp_path):
    expected = [[7.5 * HOUR, 1800]]
    memory.add_furniture("shelf", room=memory.add_room("hall"))
    memory.remove_room(1)
    assert memory.batch.clock.tolist() == expected
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert copy.clock == memory.clock == Clock(MONDAY, 1800)
    assert copy.batch.clock.tolist() == expected
    assert SceneGraphMemory().batch.clock is None


@pytest.mark.parametrize(
    "clock",
    [
        7,
        {},
        {"start": "noon", "step_seconds": 60},
        {"start": "2026-11-16", "step_seconds": -1},
        {"start": 5, "step_seconds": 60},
        {"start": "2026-11-16", "step_seconds": "60"},
        {"start": "2026-11-16T07:30+01:00", "step_seconds": 60},
    ],
)
def test_a_forged_clock_is_refused(memory, tmp_path, clock):
    path = tmp_path / "home.sgm"
    memory.save(path)
    with HomeReader(path) as reader:
        snapshot, _ = reader.read()
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        write_snapshot(connection, replace(snapshot, values={**snapshot.values, "clock": clock}))
    with pytest.raises(
        ValueError, match=r"must be as it was saved, got (?!another checksum).*home\.sgm"
    ):
        SceneGraphMemory.load(path)


def test_snapshots_know_what_time_it_is(memory):
    """Whoever has forgotten everything still knows that it is Monday 09:00."""
    snapshots = take_snapshots(memory.batch, memory.query("mug"))
    assert snapshots.clock.tolist() == [[27_000, 1800]]
    assert snapshots.time.tolist() == [3]
    assert compute_week_seconds(snapshots.clock, snapshots.time).tolist() == [9 * HOUR]
    forgotten = forget(snapshots)
    assert compute_week_seconds(forgotten.clock, forgotten.time).tolist() == [9 * HOUR]
    other = SceneGraphMemory(PriorGraph.default())
    other.add_furniture("desk", room=other.add_room("study"))
    assert take_snapshots(other.batch, other.query("mug")).clock is None


def test_a_clock_that_jumps_far_ahead_is_asked_about(memory):
    """The memory is at Monday 09:00; 31 days later is Thursday, 17 December, 09:00."""
    before = memory.to_dict()
    for wrong in (MONDAY.replace(year=2066), datetime(2026, 12, 17, 9, 30), 31 * 48 + 3 + 1):
        with pytest.raises(
            ValueError,
            match=r"time must be at most 31 days after the present step, got .* at 2026-11-16 "
            r"09:00:00\. Check the clock of the robot; if it is right, say accept_jump=True\.",
        ):
            memory.step_to(wrong)
    assert memory.to_dict() == before
    memory.step_to(datetime(2026, 12, 17, 9, 29))
    assert memory.time == 3 + 31 * 48
    memory.step_to(datetime(2027, 11, 16), accept_jump=True)
    assert memory.clock.get_time(memory.time) == datetime(2027, 11, 16)
    other = SceneGraphMemory()
    other.step_to(10**6)  # steps of no known length
    assert other.time == 10**6


def test_a_time_that_is_years_ahead_is_refused(memory):
    """Seconds for steps, or a year mistyped: nothing is asked of then, and no time passes."""
    before, now = memory.time, memory.clock.get_time(memory.time)
    steps = 366 * 86_400 // memory.clock.step_seconds
    for at in (before + int(steps) + 1, now + timedelta(days=367), now.replace(year=9999)):
        with pytest.raises(
            ValueError, match="at must be at most 366 days after the present step, got"
        ):
            memory.ask(["mug"], at=at)
        with pytest.raises(
            ValueError, match="at must be at most 366 days after the present step, got"
        ):
            Finder(Adaptive()).rank(memory, "mug", at=at)
    with pytest.raises(
        ValueError, match="num_steps must be at most 366 days after the present step, got"
    ):
        memory.step(int(steps) + 1)
    assert memory.time == before
    memory.ask(["mug"], at=now + timedelta(days=365))
    memory.step(int(steps) + 1, accept_jump=True)
    assert memory.time == before + int(steps) + 1

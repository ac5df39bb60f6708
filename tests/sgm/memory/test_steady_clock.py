"""A machine's clock that is set: time goes on, and what was wrong is said."""

from datetime import datetime, timedelta

import pytest

from sgm.memory.steady_clock import SteadyClock

START = datetime(2026, 11, 16, 8)
HOUR, DAY = timedelta(hours=1), timedelta(days=1)
STEP = timedelta(minutes=10)


def read(walls, seconds=None, present=START):
    """Read a clock that says these times, after so many seconds each."""
    num_walls, walls = len(walls), iter(walls)
    passed = None if seconds is None else iter(seconds)
    clock = SteadyClock(lambda: next(walls), None if passed is None else lambda: next(passed))
    times = []
    for _ in range(num_walls):
        times.append(clock.read(present, STEP))
        present = max(present, times[-1]) if times[-1] - present < 31 * DAY else present
    return clock, times


@pytest.mark.parametrize("wrong", [2 * HOUR, 20 * DAY, 56 * 365 * DAY])
@pytest.mark.parametrize("has_seconds", [True, False])
def test_time_goes_on_where_the_clock_goes_back(wrong, has_seconds):
    walls = [START, *(START - wrong + number * HOUR for number in range(1, 5))]
    seconds = [0, *(3600 * number for number in range(1, 5))] if has_seconds else None
    clock, times = read(walls, seconds)
    first = HOUR if has_seconds else 0 * HOUR  # what passed while it was set, nothing says else
    assert times == [START, *(START + first + number * HOUR for number in range(4))]
    assert clock.ahead == wrong - (0 * HOUR if has_seconds else HOUR)
    assert clock.num_faults == 1
    assert "went back: it says 20" in clock.tell() or "went back: it says 19" in clock.tell()


@pytest.mark.parametrize("has_seconds", [True, False])
def test_a_clock_that_is_mended_is_right(has_seconds):
    """It said 1970 for a while, and the right time again."""
    wrong, later = datetime(1970, 1, 1), START + 3 * HOUR
    walls = [START, wrong, wrong + HOUR, later, later + HOUR]
    seconds = [0, 3600, 7200, 10800, 14400] if has_seconds else None
    clock, times = read(walls, seconds)
    assert times == sorted(times)
    assert times[-1] == later + HOUR
    assert not clock.ahead
    assert clock.tell() == ""


def test_a_memory_that_is_ahead_at_the_start_goes_on():
    """The robot ran without a network once; now the time is right, and twenty days behind."""
    present = START + 20 * DAY
    clock, times = read([START, START + HOUR], present=present)
    assert times == [present, present + HOUR]
    assert (clock.ahead, clock.num_faults) == (20 * DAY, 1)


def test_less_than_a_step_is_waited_for():
    clock, times = read([START, START - STEP / 2, START + STEP], [0, 1, 901])
    assert times == [START, START - STEP / 2, START + STEP]
    assert clock.num_faults == 0


def test_a_reading_that_is_refused_leaves_no_trace():
    clock, times = read([START, START + 60 * DAY, START + HOUR], [0, 60, 3600])
    assert times == [START, START + 60 * DAY, START + HOUR]
    assert (clock.ahead, clock.num_faults) == (0 * DAY, 0)


def test_what_was_off_for_weeks_is_no_fault():
    clock, times = read([START, START + 20 * DAY], [0, 60])
    assert times[-1] == START + 20 * DAY
    assert not clock.ahead

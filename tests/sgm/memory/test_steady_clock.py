"""A clock that is set: time goes on, and what was wrong is said."""

from datetime import datetime

import pytest

from sgm.memory.clock import Clock
from sgm.memory.steady_clock import SteadyClock

HOUR, DAY, STEP = 3600.0, 86400.0, 600.0
START = Clock(datetime(2026, 11, 16, 8), STEP)


def read(readings, even=None, present=0.0, **options):
    """Read a clock that says these times, after so many seconds each, evenly."""
    passed = None if even is None else iter(even)
    clock, times = SteadyClock(None if passed is None else lambda: next(passed)), []
    for reading in readings:
        times.append(clock.read(reading, present, STEP, **options))
        present = max(present, times[-1] // STEP * STEP)
    return clock, times


def count(number, every=HOUR, first=0.0):
    return [first + every * n for n in range(number)]


@pytest.mark.parametrize("wrong", [2 * HOUR, 20 * DAY, 56 * 365 * DAY])
@pytest.mark.parametrize("is_even", [True, False])
def test_time_goes_on_where_the_clock_goes_back(wrong, is_even):
    readings = [0.0, *count(4, first=HOUR - wrong)]
    clock, times = read(readings, count(5) if is_even else None)
    first = HOUR if is_even else 0.0  # what passed while it was set, nothing says else
    assert times == [0.0, *count(4, first=first)]
    assert clock.num_faults == 1
    assert "went back: it says 20" in clock.tell(START) or "it says 19" in clock.tell(START)


@pytest.mark.parametrize("wrong", [2 * HOUR, 20 * DAY, 60 * DAY])
def test_a_clock_that_goes_ahead_for_a_moment_is_not_believed(wrong):
    """One reading, and a few within a step: time passes evenly, and is right again."""
    for number in (1, 2, 5):
        ahead = count(number, 60.0, 100.0 + wrong)
        clock, times = read([0.0, *ahead, 1000.0], [0.0, *count(number, 60.0, 100.0), 1000.0])
        assert times == [0.0, *count(number, 60.0, 100.0), 1000.0]
        assert clock.num_faults == 1
        assert clock.tell(START) == ""


@pytest.mark.parametrize("every", [30.0, 300.0, 900.0])
def test_a_clock_that_stays_ahead_for_a_step_is_believed(every):
    """The machine slept for a night, and its even clock did, too."""
    night, readings = 11 * HOUR, count(40, every)
    clock, times = read(
        [0.0, *(60.0 + night + n for n in readings)], [0.0, *count(40, every, 60.0)]
    )
    held = [time for time in times if time < night]
    assert held == [0.0, *(60.0 + n for n in readings if n < STEP)]
    assert times[-1] == 60.0 + night + readings[-1]
    assert clock.num_faults == 1
    assert clock.tell(START) == ""


def test_more_than_a_month_ahead_is_never_believed_unless_it_is_said_to_be_right():
    readings = [0.0, *(60 * DAY + n for n in count(5))]
    clock, times = read(readings, [0.0, *count(5, first=60.0)])
    assert times == [0.0, *count(5, first=60.0)]
    assert "60 days" in clock.tell(START).replace("59 days, 23:59:00", "60 days")
    assert "say accept_jump" in clock.tell(START)
    for even in (None, [0.0, 60.0]):
        assert read([0.0, 60 * DAY], even, accept_jump=True)[1] == [0.0, 60 * DAY]


def test_the_first_reading_is_believed_up_to_a_month():
    for off, first in ((7 * DAY, 7 * DAY), (31 * DAY, 31 * DAY), (60 * DAY, 0.0)):
        for even in (None, count(2)):
            clock, times = read([off, off + HOUR], even)
            assert times == [first, first + HOUR]
            assert bool(clock.tell(START)) is (first != off)


@pytest.mark.parametrize("is_even", [True, False])
def test_a_clock_that_is_mended_is_right(is_even):
    """It said 1970 for a while, and the right time again."""
    wrong, later = -56 * 365 * DAY, 3 * HOUR
    readings = [0.0, wrong, wrong + HOUR, later, later + HOUR]
    clock, times = read(readings, count(5) if is_even else None)
    assert times == sorted(times)
    assert times[-1] == later + HOUR
    assert clock.tell(START) == ""


def test_a_memory_that_is_ahead_at_the_start_goes_on():
    """The robot ran without a network once; now the time is right, and twenty days behind."""
    for even in (None, count(2)):
        clock, times = read([0.0, HOUR], even, present=20 * DAY)
        assert times == [20 * DAY, 20 * DAY + HOUR]
        assert clock.num_faults == 1


def test_a_memory_that_was_stepped_otherwise_goes_on():
    clock = SteadyClock()
    assert clock.read(0.0, 0.0, STEP) == 0.0
    assert clock.read(60.0, 5 * STEP, STEP) == 5 * STEP
    assert clock.read(60.0 + STEP, 5 * STEP, STEP) == 6 * STEP


def test_less_than_a_step_is_waited_for():
    clock, times = read([0.0, -STEP / 2, STEP], [0, 1, 901])
    assert times == [0.0, -STEP / 2, STEP]
    assert clock.num_faults == 0


@pytest.mark.parametrize("is_even", [True, False])
@pytest.mark.parametrize("length", [300.0, 1500.0])
def test_a_recording_that_is_played_again_and_again_lets_time_pass(length, is_even):
    """Also one that is shorter than a step: half an hour takes half an hour."""
    looped = [time % length for time in count(int(6 * length / 30), 30.0)]
    _, times = read(looped, count(len(looped), 30.0) if is_even else None)
    lost = 0.0 if is_even else 6 * 30.0  # what passed before the beginning, nothing says
    assert max(times) >= 5 * length - lost - STEP
    assert max(times) <= 6 * length
    steps = [int(time // STEP) for time in times]
    assert len(set(steps)) >= (4 * length - lost) // STEP


@pytest.mark.parametrize("rate", [0.5, 3, 10, 100])
def test_a_clock_that_runs_faster_or_slower_is_followed(rate):
    readings = count(1000, 2.0 * rate)
    clock, times = read(readings, count(1000, 2.0))
    assert times == readings
    assert clock.num_faults == 0


def test_readings_that_come_late_are_no_fault():
    """Messages are held up for a minute, twenty times, and come all at once then."""
    readings = count(2000, 1.0)
    even = [time if time % 100 < 40 else time // 100 * 100 + 100 for time in readings]
    clock, times = read(readings, even)
    assert times == readings
    assert clock.num_faults == 0

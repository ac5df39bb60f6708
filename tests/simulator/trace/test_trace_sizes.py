"""Numbers of a trace that size something are refused before anything is allocated."""

import json

import pytest

from simulator.trace import load_trace
from simulator.trace.source import RecordedSource

TRUTH = {
    "version": 1,
    "step_seconds": 60,
    "num_slots": 4,
    "rules": {},
    "transitions": {},
    "place_weights": {},
}


@pytest.mark.parametrize("end_s", [1e12, 1e15, 1e300])
@pytest.mark.parametrize("by_day", [False, True])
def test_a_recording_of_too_many_steps_is_refused(write_home, end_s, by_day):
    folder = write_home(end_s=end_s)
    with pytest.raises(ValueError, match=r"at most 10000000 steps, got 1e\+\d+ s in .* for home"):
        RecordedSource(folders=[str(folder)], by_day=by_day)


@pytest.mark.parametrize("seconds", [1e-5, 1e-300, 5e-324])
@pytest.mark.parametrize("by_day", [False, True])
def test_a_step_that_is_too_short_is_refused(write_home, seconds, by_day):
    folder = write_home(end_s=200_000)
    with pytest.raises(ValueError, match=r"at most 10000000 steps|step must divide a day"):
        RecordedSource(folders=[str(folder)], step_seconds=seconds, by_day=by_day)


@pytest.mark.parametrize("by_day", [False, True])
def test_a_recording_that_ends_after_the_last_year_is_refused(write_home, by_day):
    folder = write_home(start="9999-12-30T00:00", end_s=200_000)
    with pytest.raises(ValueError, match=r"end before the year 9999, got 200000 s after 9999"):
        RecordedSource(folders=[str(folder)], by_day=by_day)


@pytest.mark.parametrize("num_slots", [3e9, 1e300, 0, -1, "many", None, 10**400])
def test_slots_of_a_simulated_home_have_a_bound(write_home, num_slots):
    folder = write_home()
    (folder / "simulation.json").write_text(json.dumps({**TRUTH, "num_slots": num_slots}))
    with pytest.raises(ValueError, match=r"simulation\.json: simulation must be whole, got"):
        load_trace(folder)


def test_a_truth_of_the_right_size_is_read(write_home):
    folder = write_home()
    (folder / "simulation.json").write_text(json.dumps(TRUTH))
    assert load_trace(folder).num_slots == 4

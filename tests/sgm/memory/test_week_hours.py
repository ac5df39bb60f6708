"""Looks and sightings by hour of the working day and of the weekend."""

import json
from datetime import datetime

import numpy as np
import pytest

from sgm.arrays.week import NUM_WEEK_HOURS, compute_week_hours
from sgm.memory.clock import Clock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import read_events
from sgm.memory.week_hours import WeekHours
from simulator import SceneGraphMemory, Sighting

MONDAY = datetime(2026, 11, 16, 8)


def make_home(clock=None):
    memory = SceneGraphMemory(clock=clock)
    hall = memory.add_room("hall")
    return memory, memory.add_furniture("dresser", hall), memory.add_furniture("shelf", hall)


def test_hours_of_working_days_come_before_those_of_the_weekend():
    clock = np.array([Clock(MONDAY).row, (np.nan, np.nan)])
    hours = [compute_week_hours(clock, step).tolist() for step in (0, 15, 16, 5 * 24, 7 * 24)]
    # Monday 8:00 and 23:00, Tuesday 0:00, Saturday 8:00 (24 + 8), Monday 8:00 again.
    assert hours == [[8, -1], [23, -1], [0, -1], [32, -1], [8, -1]]


def test_every_look_and_sighting_is_counted_at_its_hour():
    memory, dresser, shelf = make_home(Clock(MONDAY, 1800))
    memory.observe(dresser, [Sighting("keys"), Sighting("wallet")])
    memory.step()  # 8:30
    memory.observe(dresser, [Sighting("wallet")])
    memory.step(3)  # 10:00
    memory.observe(shelf, [Sighting("keys")])
    memory.observe(shelf, [], coverage=0.3)  # no look at the furniture
    memory.step(48 * 5)  # Saturday
    memory.observe(dresser, [])
    week = memory.batch.history.week
    assert np.argwhere(week.looks[0]).tolist() == [[0, 8], [0, 34], [1, 10]]
    assert week.looks[0, 0, 8] == 2
    seen = week.get_seen(np.arange(3))  # the third is not there
    assert np.argwhere(seen).tolist() == [[0, 8], [0, 10], [1, 8]]
    assert (seen[1, 8], seen[0, 8]) == (2, 1)


def test_without_a_clock_nothing_is_counted_and_takes_no_memory():
    memory, dresser, _ = make_home()
    memory.observe(dresser, [Sighting("keys")])
    week = memory.batch.history.week
    assert not week.is_counted
    assert week.looks.strides == (0, 0, 0)
    assert not week.get_seen(np.arange(1)).any()


def test_what_is_left_when_all_places_with_looks_are_removed_was_never_looked_at(tmp_path):
    memory, dresser, shelf = make_home(Clock(MONDAY))
    memory.observe(dresser, [Sighting("keys")])
    memory.remove_furniture(dresser)
    memory.save(tmp_path / "home.sgm")
    for each in (memory, SceneGraphMemory.load(tmp_path / "home.sgm")):
        assert not each.batch.history.week.is_counted
        each.observe(shelf, [Sighting("keys")])
        assert each.batch.history.week.is_counted


def test_counts_follow_what_is_added_and_removed(tmp_path):
    memory, dresser, shelf = make_home(Clock(MONDAY))
    for thing in ("keys", "wallet", "phone"):
        memory.observe(dresser, [Sighting(thing)])
        memory.step()
    hook = memory.add_furniture("hook", 0)
    memory.observe(hook, [Sighting("phone")])
    memory.remove_object("keys")
    memory.remove_furniture(shelf)
    week = memory.batch.history.week
    assert np.argwhere(week.looks[0]).tolist() == [[0, 8], [0, 9], [0, 10], [1, 11]]
    seen = week.get_seen(np.arange(2))
    assert np.argwhere(seen).tolist() == [[0, 9], [1, 10], [1, 11]]
    memory.step()
    memory.save(tmp_path / "home.sgm")
    again = SceneGraphMemory.load(tmp_path / "home.sgm").batch.history.week
    np.testing.assert_array_equal(again.looks, week.looks)
    np.testing.assert_array_equal(again.get_seen(np.arange(2)), seen)
    copy = memory.copy()
    copy.observe(hook, [])
    assert memory.batch.history.week.looks.sum() == 4


def test_counts_are_in_the_file(tmp_path):
    memory, dresser, _ = make_home(Clock(MONDAY))
    memory.observe(dresser, [Sighting("keys")])
    memory.step()
    memory.save(tmp_path / "home.sgm")
    data = read_events(tmp_path / "home.sgm")[0].values["memory"].to_json()
    assert data["week"] == {"looks": [[0], [8], [1]], "seen": [[0], [8], [1]]}
    data["week"] = {"looks": [], "seen": []}
    assert not MemoryContent.from_json(data).history.week.is_counted


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("looks", [[2], [0], [1]]),
        ("looks", [[0], [NUM_WEEK_HOURS], [1]]),
        ("looks", [[0], [0], [1 << 16]]),
        ("looks", [[-1], [0], [1]]),
        ("seen", [[1], [0], [1]]),
        ("seen", [[0], [0]]),
        ("seen", [[0.5], [0], [1]]),
    ],
)
def test_counts_that_fit_no_home_are_refused(name, values):
    with pytest.raises(ValueError, match=f"week hours {name} must"):
        WeekHours.from_json(json.loads(json.dumps({"looks": [], "seen": [], name: values})), 2, 1)

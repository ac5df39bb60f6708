"""Things that keep hours: by hand, by law, and in a home in which it is plain."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from sgm.evidence.features import compute_features
from sgm.evidence.hours import compute_keeping
from sgm.memory.home_history import NUM_HOURS
from simulator import Clock, SceneGraphMemory, Sighting

NOON = NUM_HOURS // 2


def keeping(*sightings: tuple[int, int, int]) -> float:
    """Of one object that was seen (place, hour, times), in a home of four places."""
    hours = np.zeros((1, 4, NUM_HOURS), dtype=np.float32)
    for place, hour, times in sightings:
        hours[0, place, hour] += times
    return float(compute_keeping(hours, np.array([4]))[0])


def test_two_sightings_by_hand():
    """By the other sighting alone, its place has (0 + 1/8) / (1 + 1/2) = 1/12.

    At its own hour, where the other counts for exp(-8), it has 2/12 of 2 + exp(-8).
    """
    evidence = 2 * np.log(2 / (2 + np.exp(-8)))
    expected = 1 / (1 + np.exp(4 - evidence))
    assert keeping((0, NOON, 1), (1, 0, 1)) == pytest.approx(expected, rel=1e-6)


def test_a_thing_that_is_always_at_one_place_keeps_no_hours():
    assert keeping((0, NOON, 30), (0, 0, 30)) < 0.03
    assert keeping() == keeping((0, NOON, 1)) == 0  # nothing to tell it from


def test_a_thing_with_a_place_for_the_day_and_one_for_the_night_keeps_hours():
    assert keeping((0, NOON, 10), (1, 0, 10)) > 0.99
    assert keeping((0, NOON, 5), (1, 0, 5), (1, NOON, 5), (0, 0, 5)) < 0.05  # both at any hour
    few, more = (keeping((0, NOON, n), (1, 0, n)) for n in (2, 4))
    assert few < more


def test_without_a_clock_nothing_keeps_hours():
    assert compute_keeping(None, np.array([4])) == 0


def test_where_it_is_by_the_hour():
    """Ten days at a desk by day and on a bed by night; last seen at night, asked for at noon."""
    start = datetime(2026, 11, 2)
    memory = SceneGraphMemory(clock=Clock(start, 3600))
    room = memory.add_room("study")
    places = [memory.add_furniture(label, room) for label in ("desk", "bed", "shelf")]
    for hour in range(241):
        here = 0 if 8 <= hour % 24 < 20 else 1
        for number, place in enumerate(places):
            seen = [Sighting("laptop", relation="onTop")] if number == here else []
            memory.observe(place, seen)
        memory.step()
    asked = memory.ask(["laptop"], at=start + timedelta(days=10, hours=12))
    share, belief = compute_features(asked.batch, asked.queries).follow_hours()
    assert share > 0.99
    assert belief[0].argmax() == 0  # though it was last seen on the bed
    assert belief[0, 0] > 0.8

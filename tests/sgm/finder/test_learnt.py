"""What a memory says it has learnt of a home."""

import math
from datetime import datetime, timedelta

import pytest

from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from tests.sgm.finder.rhythm_stories import tell_car_keys, tell_lunch_box, tell_tablet, tell_weekend

MONDAY = datetime(2026, 1, 5)


@pytest.fixture(scope="module")
def finder():
    return Finder(Adaptive())


def make_home(*places, clock=True):
    memory = SceneGraphMemory(clock=Clock(MONDAY, 1800) if clock else None)
    room = memory.add_room("hall")
    return memory, [memory.add_furniture(place, room) for place in places]


def live(memory, places, times, where, thing="keys"):
    for now in times:
        memory.step_to(now)
        for number, place in enumerate(places):
            memory.observe(place, [Sighting(thing)] if number == where(now) else [])


def list_times(num_days, *hours):
    for day in range(num_days):
        for hour in hours:
            yield MONDAY + timedelta(days=day, hours=hour)


def get_thing(learnt, name):
    return next(thing for thing in learnt.things if thing.thing == name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flat", "line"),
    [
        (
            lambda: tell_tablet(20, 12.2),
            "tablet: dining table in kitchen on all days at 12; "
            "dresser in bedroom in 67% of the looks",
        ),
        (
            lambda: tell_car_keys(28, 11.2),
            "car keys: out on workdays from 11 to 15; shelf in living room in 72% of the looks",
        ),
        (
            lambda: tell_lunch_box(20, 1.0),
            "lunch box: from counter in kitchen to fridge in kitchen after 2 h (20 of 20); "
            "from dining table in kitchen to counter in kitchen after 1 h (20 of 20); "
            "fridge in kitchen in 49% of the looks",
        ),
        (
            lambda: tell_weekend(21, 12),
            "football: sofa in living room on weekends from 10 to 18; "
            "hook in hall in 72% of the looks",
        ),
    ],
    ids=["hours", "out", "sequence", "weekend"],
)
def test_a_rhythm_is_said_in_words(finder, flat, line):
    learnt = finder.learnt(flat().memory)
    assert str(learnt.things[0]) == line  # what has no rhythm comes after it
    assert [thing.rhythm for thing in learnt.things[1:]] == ["any"] * (len(learnt.things) - 1)
    assert learnt.right > 0.9
    assert 0.8 < learnt.sure < 1


def test_hours_in_a_row_last_until_the_next_place(finder):
    """On the shelf until 8, on the desk until 22: hours that follow each other have one border."""
    memory, places = make_home("shelf", "desk")
    live(memory, places, list_times(8, *range(24)), lambda now: int(8 <= now.hour < 22))
    (stay,) = get_thing(finder.learnt(memory), "keys").stays
    assert (stay.place, stay.days, stay.begin, stay.end) == (places[0], "all days", 22, 8)
    assert stay.tell() == "shelf in hall on all days from 22 to 8"


def test_what_was_never_looked_for_is_not_said_to_be_out(finder):
    """At noon one of its two places is looked at alone; that it is at the other nothing says."""
    memory, (shelf, desk) = make_home("shelf", "desk")
    for day in range(12):
        for hour, there in ((7, shelf), (12, desk), (20, shelf)):
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            looked = [shelf] if hour == 12 and day > 2 else [shelf, desk]
            for place in looked:
                memory.observe(place, [Sighting("keys")] if place == there else [])
    memory.step_to(MONDAY + timedelta(days=12, hours=11))
    assert None not in [stay.place for stay in get_thing(finder.learnt(memory), "keys").stays]


def test_a_thing_without_a_rhythm_has_its_usual_place(finder):
    memory, places = make_home("shelf", "desk")
    live(memory, places, list_times(10, 9, 15), lambda now: 0, "vase")
    (vase,) = finder.learnt(memory).things
    assert (vase.rhythm, vase.usual, vase.share) == ("any", places[0], 1.0)
    assert str(vase) == "vase: shelf in hall in 100% of the looks"


def test_what_was_seen_a_few_times_is_not_told_of(finder):
    memory, places = make_home("shelf", "desk")
    live(memory, places, list_times(1, 7, 12, 20), lambda now: 0)
    learnt = finder.learnt(memory)
    assert learnt.things == ()
    assert learnt.num_looks == 2  # the looks after the first


def test_without_a_clock_or_a_thing_nothing_is_learnt(finder):
    for clock in (True, False):
        memory, places = make_home("shelf", clock=clock)
        if not clock:
            memory.observe(places[0], [Sighting("keys")])
        learnt = finder.learnt(memory)
        assert learnt.things == ()
        assert learnt.num_looks == 0
        assert math.isnan(learnt.sure)
        assert str(learnt) == "nothing yet"


def test_what_was_learnt_is_in_the_file(finder, tmp_path):
    path = tmp_path / "home.sgm"
    memory, places = make_home("shelf", "desk")
    live(memory, places, list_times(9, 7, 12, 20), lambda now: int(now.hour == 12))
    memory.save(path)
    learnt = finder.learnt(memory)
    assert finder.learnt(SceneGraphMemory.load(path)) == learnt
    assert finder.learnt(memory.copy()) == learnt
    assert learnt.num_looks > 20


def test_two_nodes_that_were_merged_are_told_of_once(finder):
    memory, places = make_home("shelf", "desk")
    live(memory, places, list_times(9, 7, 20), lambda now: 0)
    live(memory, places, (now + timedelta(days=10) for now in list_times(2, 7)), lambda now: 1, "k")
    memory.merge("keys", "k")
    assert [thing.thing for thing in finder.learnt(memory).things] == ["keys"]


def test_k_bounds_the_things_and_must_be_one_or_more(finder):
    memory, places = make_home("shelf", "desk")
    for thing in ("keys", "vase"):
        later = 0 if thing == "keys" else 12
        times = (now + timedelta(days=later) for now in list_times(9, 7, 20))
        live(memory, places, times, lambda now: 0, thing)
    assert len(finder.learnt(memory).things) == 2
    assert len(finder.learnt(memory, k=1).things) == 1
    with pytest.raises(ValueError, match=r"k must be at least 1, got 0\. .* all things"):
        finder.learnt(memory, k=0)

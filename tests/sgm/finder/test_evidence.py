"""What is said for and against a place, in words."""

from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting


def make_memory(clock=None):
    memory = SceneGraphMemory(clock=clock)
    kitchen = memory.add_room("kitchen")
    return memory, memory.add_furniture("table", kitchen), memory.add_furniture("shelf", kitchen)


def tell(memory, thing, furniture):
    places = {place.furniture: place for place in Finder(Bayesian()).rank(memory, thing)}
    return places[furniture].why.split("; prior")[0]


@pytest.mark.parametrize("number", [1, 8, 80])
def test_all_looks_are_counted(number):
    memory, table, _ = make_memory()
    for _ in range(number):
        memory.observe(table, [])
        memory.step()
    looks = "1 look" if number == 1 else f"{number} looks"
    assert tell(memory, "cup", table) == f"not seen here in {looks}"


def test_looks_of_this_step_and_searches_are_counted():
    memory, table, shelf = make_memory()
    memory.observe(table, [])
    memory.step()
    memory.observe(table, [])
    memory.note_absent(table, "cup")
    assert tell(memory, "cup", table) == "not seen here in 3 looks"
    memory.step()
    assert tell(memory, "cup", table) == "not seen here in 3 looks"
    assert tell(memory, "cup", shelf) in ("no evidence", tell(memory, "lid", shelf))


def test_what_two_looks_of_a_step_say():
    memory, table, _ = make_memory()
    memory.observe(table, [Sighting("cup")])
    memory.observe(table, [])
    told = tell(memory, "cup", table)
    assert told == "seen here in this step, not in the latest look"


def test_looks_for_it_alone_are_told_beside_a_sighting():
    """It said "seen here 1 step ago" beside 6 %, and nothing of three looks for it since."""
    memory, table, _ = make_memory()
    memory.observe(table, [Sighting("cup")])
    memory.step()
    memory.note_absent(table, "cup", coverage=0.2)  # a glance, after which it may be there still
    told = "seen here 1 step ago; not found here in 1 look for it since"
    assert tell(memory, "cup", table) == told
    for _ in range(3):
        memory.note_absent(table, "cup")
    assert tell(memory, "cup", table) == "seen here 1 step ago, then gone"
    memory.observe(table, [])
    assert tell(memory, "cup", table) == "seen here 1 step ago, then gone"
    memory.observe(table, [Sighting("cup")])
    assert tell(memory, "cup", table) == "seen here in this step"


def test_a_probability_does_not_contradict_the_sentence():
    """It stayed at 97 % beside "then gone"."""
    memory, table, _ = make_memory()
    memory.observe(table, [Sighting("cup")])
    for _ in range(4):
        memory.observe(table, [])
    (place,) = [p for p in Finder(Bayesian()).rank(memory, "cup") if p.furniture == table]
    assert place.why.startswith("seen here in this step, not in the latest look")
    assert place.probability < 0.7


def test_hours_and_days_where_there_is_a_clock():
    memory, table, _ = make_memory(Clock(datetime(2026, 11, 16, 21, 40), step_seconds=600))
    memory.observe(table, [Sighting("cup")])
    memory.step_to(datetime(2026, 11, 16, 22, 0))
    assert tell(memory, "cup", table) == "seen here at 21:40"
    memory.step_to(datetime(2026, 11, 17, 9, 10))
    memory.observe(table, [])
    memory.step()
    assert tell(memory, "cup", table) == "seen here yesterday at 21:40; not there at 9:10"
    memory.step_to(datetime(2026, 11, 20, 9, 10))
    told = "seen here on 16 November at 21:40; not there on 17 November at 9:10"
    assert tell(memory, "cup", table) == told
    memory.step_to(datetime(2027, 1, 2, 9, 10), accept_jump=True)
    assert tell(memory, "cup", table).startswith("seen here on 16 November 2026 at 21:40; not")


def test_steps_where_there_is_none():
    memory, table, _ = make_memory()
    memory.observe(table, [Sighting("cup")])
    memory.step(2)
    assert tell(memory, "cup", table) == "seen here 2 steps ago"
    memory.observe(table, [])
    assert tell(memory, "cup", table) == "seen here 2 steps ago, then gone"

"""What is said of a place where a thing was, once a statement has ended that."""

from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting

DRAWER, SHELF, TABLE = range(3)
CLOCK = Clock(datetime(2026, 11, 20, 20, 0), step_seconds=600)


@pytest.fixture(params=[None, CLOCK], ids=["steps", "clock"])
def memory(request):
    """Keys, and a red mug, that were just seen on the table."""
    memory = SceneGraphMemory(clock=request.param)
    kitchen = memory.add_room("kitchen")
    for label in ("drawer", "shelf", "table"):
        memory.add_furniture(label, kitchen)
    memory.observe(TABLE, [Sighting("keys"), Sighting("red mug")])
    return memory


def tell(memory, thing, place):
    (own,) = [one for one in Finder(Bayesian()).rank(memory, thing) if one.furniture == place]
    return own.why.split("; prior")[0].split("; similar")[0]


def choose(memory, in_steps, by_clock):
    return in_steps if memory.clock is None else by_clock


@pytest.mark.parametrize("relation", ["in", "on"])
def test_a_person_moved_it_in_the_step_in_which_it_was_seen(memory, relation):
    memory.note_moved("keys", DRAWER, "anna", relation)
    now = choose(memory, "in this step", "at 20:00")
    assert tell(memory, "keys", DRAWER) == f"anna said so {now}"
    assert tell(memory, "keys", TABLE) == f"seen here in this step; anna said it was moved {now}"
    memory.step(2)
    then = choose(memory, "2 steps ago", "at 20:00")
    assert tell(memory, "keys", TABLE) == f"seen here {then}; anna said it was moved {then}"


def test_a_person_moved_it_later_and_a_look_bears_that_out(memory):
    memory.step(3)
    memory.note_moved("keys", DRAWER, "you")
    memory.step(141)
    told = choose(
        memory,
        "seen here 144 steps ago; you said it was moved 141 steps ago",
        "seen here yesterday at 20:00; you said it was moved yesterday at 20:30",
    )
    assert tell(memory, "keys", TABLE) == told
    memory.observe(TABLE, [])
    told += choose(memory, "; not there in a look since", "; not there at 20:00")
    assert tell(memory, "keys", TABLE) == told


def test_a_look_after_the_statement_in_its_step_shows_it_there_again(memory):
    memory.note_moved("keys", DRAWER, "anna")
    memory.observe(TABLE, [Sighting("keys")])
    assert tell(memory, "keys", TABLE) == "seen here in this step"
    now = choose(memory, "in this step", "at 20:00")
    assert tell(memory, "keys", DRAWER) == f"anna said so {now}; seen elsewhere since"


def test_a_look_of_the_same_step_has_the_last_word(memory):
    """The last sighting was where somebody said it was, although a look showed it elsewhere."""
    memory.note_moved("keys", DRAWER, "anna")
    memory.observe(SHELF, [Sighting("keys")])
    last = memory.last_seen("keys")
    assert (last.furniture, last.by) == (SHELF, "")
    assert [seen.by for seen in memory.places_of("keys")] == ["", "anna", ""]
    now = choose(memory, "in this step", "at 20:00")
    assert tell(memory, "keys", DRAWER) == f"anna said so {now}; seen elsewhere since"


def test_what_somebody_said_is_corrected_by_somebody_else(memory):
    """The former place was never seen: it was said, which stays said."""
    memory.note_moved("keys", DRAWER, "anna")
    memory.step()
    memory.note_moved("keys", SHELF, "tom")
    memory.step()
    told = choose(
        memory,
        "anna said so 2 steps ago; tom said it was moved 1 step ago",
        "anna said so at 20:00; tom said it was moved at 20:10",
    )
    assert tell(memory, "keys", DRAWER) == told
    told = choose(
        memory,
        "seen here 2 steps ago; anna said it was moved 2 steps ago",
        "seen here at 20:00; anna said it was moved at 20:00",
    )
    assert tell(memory, "keys", TABLE) == told
    memory.observe(TABLE, [Sighting("keys")])  # a look has the last word, and ends neither
    assert [seen.by for seen in memory.places_of("keys")] == ["", "tom", "anna"]


def test_the_robot_takes_it_and_puts_it_down(memory):
    memory.step()
    memory.picked_up("red mug")
    then = choose(memory, "in this step", "at 20:10")
    seen = choose(memory, "1 step ago", "at 20:00")
    assert tell(memory, "mug", TABLE) == f"seen here {seen}; the robot picked it up {then}"
    memory.put_down("mug", SHELF)
    memory.step()
    ago = choose(memory, "1 step ago", "at 20:10")
    seen = choose(memory, "2 steps ago", "at 20:00")
    assert tell(memory, "mug", SHELF) == f"put here by the robot {ago}"
    assert tell(memory, "mug", TABLE) == f"seen here {seen}; the robot picked it up {ago}"
    memory.picked_up("red mug")
    again = choose(memory, "in this step", "at 20:20")
    told = f"put here by the robot {ago}; the robot picked it up {again}"
    assert tell(memory, "mug", SHELF) == told


def test_what_is_seen_while_the_robot_carries_it_is_put_elsewhere(memory):
    memory.picked_up("red mug")
    memory.observe(TABLE, [Sighting("red mug")])
    memory.put_down("mug", SHELF)
    now = choose(memory, "in this step", "at 20:00")
    told = f"seen here in this step; the robot put it elsewhere {now}"
    assert tell(memory, "mug", TABLE) == told


def test_one_of_two_is_moved(memory):
    for place, number in ((TABLE, "f1"), (DRAWER, "f2")):
        memory.observe(place, [Sighting("fork", id=number)])
    memory.note_moved("f1", SHELF, "anna")
    memory.step()
    memory.observe(DRAWER, [])
    gone = choose(
        memory, "seen here 1 step ago, then gone", "seen here at 20:00; not there at 20:10"
    )
    assert tell(memory, "fork", DRAWER) == gone
    then = choose(memory, "1 step ago", "at 20:00")
    told = f"seen here {then}; anna said it was moved {then}"
    assert tell(memory, "fork", TABLE) == told


def test_a_name_and_a_merge_change_nothing(memory):
    memory.observe(SHELF, [Sighting("blue mug")])
    memory.step()
    memory.note_moved("red mug", DRAWER, "anna")
    memory.rename("red mug", "cup", "tom")
    memory.merge("blue mug", "cup", "tom")
    seen, said = choose(memory, ("1 step ago", "in this step"), ("at 20:00", "at 20:10"))
    told = f"seen here {seen}; anna said it was moved {said}"
    assert tell(memory, "blue mug", TABLE) == told
    memory.forget("blue mug", "anna")  # nothing is left to be said of it
    assert tell(memory, "blue mug", TABLE) == "not seen here in 1 look"


def test_what_was_forgotten_and_seen_again_begins_anew(memory):
    memory.note_moved("keys", DRAWER, "anna")
    memory.forget("keys", "anna")
    memory.observe(SHELF, [Sighting("keys")])
    assert tell(memory, "keys", SHELF) == "seen here in this step"
    assert "anna" not in tell(memory, "keys", TABLE)


def test_statements_that_are_kept_no_longer_make_no_looks(memory):
    """Of more than eight statements the oldest are left out: what they ended is gone, unseen."""
    memory.step()
    memory.note_moved("keys", SHELF, "anna")
    for number in range(9):
        memory.step()
        memory.note_moved("keys", DRAWER, "anna", "in" if number % 2 else "on")
    told = choose(
        memory, "seen here 10 steps ago, then gone", "seen here at 20:00; not there at 20:10"
    )
    assert tell(memory, "keys", TABLE) == told


def test_where_it_was_seen_in_parts_of_looks(memory):
    """Two looks with half of the table in view end it; neither alone is a look at the table."""
    memory.step()
    for _ in range(2):
        memory.observe(TABLE, [], 0.4)
    told = choose(
        memory, "seen here 1 step ago, then gone", "seen here at 20:00; not there at 20:10"
    )
    assert tell(memory, "keys", TABLE) == told


def test_a_look_that_shows_one_of_a_kind_is_no_search_that_failed():
    """It missed the other one, which is elsewhere; a look for them after it did miss it."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    counter, sofa = memory.add_furniture("counter", room), memory.add_furniture("sofa", room)
    memory.observe(counter, [Sighting("large red mug")])
    memory.step(3)
    memory.observe(sofa, [Sighting("red mug")])
    assert tell(memory, "red mug", sofa) == "seen here in this step"
    memory.note_absent(sofa, "red mug")
    assert tell(memory, "red mug", sofa) == "seen here in this step, not in the latest look"

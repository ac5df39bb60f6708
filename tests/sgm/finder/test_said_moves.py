"""What the belief makes of a statement: a sighting of that thing, and none of it where it was."""

import json
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.policies.adaptive import Adaptive
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting

DRAWER, SHELF, TABLE = range(3)
POLICIES = {"bayesian": Bayesian, "adaptive": Adaptive}


def live(num_days, clock=None):
    """Keys that were seen on the table again and again, among other things."""
    memory = SceneGraphMemory(clock=clock)
    hall = memory.add_room("hall")
    for label in ("drawer", "shelf", "table"):
        memory.add_furniture(label, hall)
    for _ in range(num_days):
        memory.observe(TABLE, [Sighting("keys"), Sighting("wallet")])
        memory.observe(SHELF, [Sighting("book")])
        memory.step(24)
    return memory


def state(memory, confidence=None):
    memory.note_moved("keys", DRAWER, "anna", confidence=confidence)


def show(memory, confidence=0.9):
    """Looks, for the keys alone, that say the same."""
    others = ["wallet", "book"]
    memory.observe(TABLE, [], hidden=others)
    memory.observe(DRAWER, [Sighting("keys", "in", confidence)], hidden=others)


def rank(finder, memory, thing="keys", at=None):
    ranking = finder.rank(memory, thing, at=at)
    total = sum(place.probability for place in ranking) + ranking.elsewhere + ranking.with_robot
    assert total == pytest.approx(1)
    return {place.furniture: place.probability for place in ranking}


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("num_days", [1, 10])
@pytest.mark.parametrize("num_steps", [1, 6])
def test_a_statement_is_believed_as_much_as_looks_that_show_the_same(policy, num_days, num_steps):
    """Or more: it is right with its confidence, .9, where one look misses a fifth of what is there.

    A thing is as likely as that where it was said to be a step ago, and else where it was.
    """
    stated, shown = live(num_days), live(num_days)
    state(stated)
    show(shown)
    for memory in (stated, shown):
        memory.step(num_steps)
    finder = Finder(POLICIES[policy]())
    told, seen = rank(finder, stated), rank(finder, shown)
    assert seen[DRAWER] - 0.03 < told[DRAWER] <= 0.9
    assert told[TABLE] < seen[TABLE] + 0.03
    if num_steps == 1:
        assert told[DRAWER] > 0.85


def test_the_network_believes_a_person_as_much_as_looks_that_show_the_same():
    """It had .60 for the drawer, and .74 with looks."""
    clock = Clock(datetime(2026, 11, 16, 8, 0))
    stated, shown = live(10, clock), live(10, clock)
    state(stated)
    show(shown)
    for memory in (stated, shown):
        memory.step()
    finder = ObjectFinder.load()
    told, seen = rank(finder, stated), rank(finder, shown)
    assert told[DRAWER] > seen[DRAWER] - 0.05
    assert told[TABLE] < seen[TABLE] + 0.05


@pytest.mark.parametrize("policy", POLICIES)
def test_nothing_is_said_of_the_other_things(policy):
    memory = live(5)
    state(memory)
    memory.step()
    finder, again = (Finder(POLICIES[policy]()) for _ in range(2))
    history = json.dumps(memory.batch.history.to_json())
    wallet = finder.rank(memory, "wallet")
    rank(finder, memory)
    assert again.rank(memory, "wallet") == wallet == finder.rank(memory, "wallet")
    assert json.dumps(memory.batch.history.to_json()) == history
    assert memory.batch.furniture_num_observed.tolist() == [[0, 5, 5]]


def test_who_may_be_wrong_leaves_as_much_where_it_was():
    believed = []
    for confidence in (1.0, 0.75, 0.5):
        memory = live(5)
        state(memory, confidence)
        memory.step()
        believed.append(rank(Finder(Bayesian()), memory)[TABLE])
    assert believed[2] > believed[1] + 0.1 > believed[0] + 0.2
    assert believed[2] > 0.5


def test_it_is_forgotten_as_a_look_is():
    """Long after, the place is as likely as if nobody had said that it left there."""
    memory = live(5)
    state(memory)
    finder = Finder(Bayesian())
    table = [rank(finder, memory, at=memory.time + later)[TABLE] for later in (1, 10, 200)]
    assert table == sorted(table)
    assert table[2] > table[0] + 0.1


@pytest.mark.parametrize("policy", POLICIES)
def test_a_look_that_shows_it_has_the_last_word(policy):
    """Then nothing is made of the statement any more, beside a sighting."""
    stated, shown = live(5), live(5)
    state(stated)
    stated.step()
    show(shown)
    shown.step()
    for memory in (stated, shown):
        memory.observe(TABLE, [Sighting("keys")])
        memory.observe(DRAWER, [])
        memory.step()
    finder = Finder(POLICIES[policy]())
    told, seen = rank(finder, stated), rank(finder, shown)
    assert told[TABLE] == pytest.approx(seen[TABLE], abs=0.03)
    assert told[TABLE] > 0.6 > told[DRAWER]


def test_of_several_things_one_was_moved():
    memory = SceneGraphMemory()
    hall = memory.add_room("hall")
    for label in ("drawer", "shelf", "table"):
        memory.add_furniture(label, hall)
    for _ in range(4):
        memory.observe(TABLE, [Sighting("mug", id="m1")])
        memory.observe(SHELF, [Sighting("mug", id="m2")])
        memory.step()
    memory.note_moved("m1", DRAWER, "anna")
    memory.step()
    finder = Finder(Bayesian())
    both = {place.furniture: place.probability for place in finder.rank(memory, "mug")}
    first, second = rank(finder, memory, "m1"), rank(finder, memory, "m2")
    for place in (DRAWER, SHELF, TABLE):  # either is there
        assert both[place] == pytest.approx(1 - (1 - first[place]) * (1 - second[place]))
    assert first[DRAWER] > first[TABLE]
    assert second[SHELF] > 0.5


def test_what_the_robot_carries_is_where_it_was_if_it_lost_it():
    memory = live(5)
    memory.picked_up("keys", confidence=0.6)
    memory.step()
    ranking = Finder(Bayesian()).rank(memory, "keys")
    assert ranking.with_robot == 0.6
    assert ranking[0].furniture == TABLE

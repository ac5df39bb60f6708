"""Looks of one time step have an order: what they show last holds, whatever they show."""

import json

import pytest

from sgm.finder.finder import Finder
from sgm.memory.look import MOST_KEPT, MOST_LOOKS
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian

TABLE, DRAWER, SHELF, DESK = range(4)
POLICIES = pytest.mark.parametrize("policy", [Adaptive, Bayesian])
pytestmark = pytest.mark.filterwarnings("ignore::sgm.memory.memory_looks.LookPerFrameWarning")


def make_memory():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    for label in ("table", "drawer", "shelf", "desk"):
        memory.add_furniture(label, room)
    return memory


def rank(memory, thing, policy=Adaptive):
    return {place.furniture: place.probability for place in Finder(policy()).rank(memory, thing)}


def look(memory, place, *things, times=1):
    for _ in range(times):
        memory.observe(place, [Sighting(thing) for thing in things])


@POLICIES
@pytest.mark.parametrize("num_before", [0, 3, MOST_LOOKS, 5 * MOST_LOOKS])
def test_that_a_thing_has_gone_is_news_as_much_as_that_it_came(policy, num_before):
    """The cap on looks of a step dropped those that show less."""
    memory = make_memory()
    look(memory, TABLE, times=num_before)
    look(memory, TABLE, "cat")
    assert memory.last_seen("cat").is_there
    seen = rank(memory, "cat", policy)[TABLE]
    look(memory, TABLE, times=2)
    assert not memory.last_seen("cat").is_there
    now = rank(memory, "cat", policy)[TABLE]
    assert now < seen - 0.15
    memory.step()
    later = rank(memory, "cat", policy)[TABLE]  # the night between is no look that shows it
    assert later < (now if policy is Adaptive else seen - 0.15)


@POLICIES
@pytest.mark.parametrize("num_before", [1, MOST_LOOKS, 3 * MOST_LOOKS])
@pytest.mark.parametrize("is_drawer_first", [True, False])
def test_what_goes_from_one_place_to_another_is_at_that_alone(policy, num_before, is_drawer_first):
    memory = make_memory()
    look(memory, TABLE, "mug", times=num_before)
    if is_drawer_first:
        look(memory, DRAWER, "mug")
    look(memory, TABLE)
    if not is_drawer_first:
        look(memory, DRAWER, "mug")
    for steps in (0, 1):
        memory.step(steps)
        places = rank(memory, "mug", policy)
        assert max(places, key=places.get) == DRAWER
        assert places[TABLE] < (0.55 * places[DRAWER] if steps else 0.05)
        assert [seen.furniture for seen in memory.places_of("mug") if seen.is_there] == [DRAWER]
    assert memory.ask(["mug"]).num_instances.tolist() == [1]


@pytest.mark.parametrize("times", [MOST_LOOKS, 300])
def test_what_shows_the_same_is_ten_looks(times):
    memory = make_memory()
    look(memory, TABLE, "mug", times=times)
    look(memory, TABLE, times=times)
    look(memory, TABLE, "mug", "pen", times=times)
    assert memory.batch.furniture_num_observed[0, TABLE] == 3 * MOST_LOOKS
    assert memory.last_seen("mug").times_seen == 2 * MOST_LOOKS


def test_a_thing_that_came_back_is_there_again():
    """Looks as before were left out, while the thing had been seen elsewhere meanwhile."""
    memory = make_memory()
    for place in (TABLE, DRAWER, TABLE, DRAWER, TABLE):
        memory.observe(place, [Sighting("mug", id="7")] * 1)
        for _ in range(MOST_LOOKS):
            memory.observe(place, [Sighting("mug", id="7")])
    assert memory.last_seen("7").furniture == TABLE
    assert rank(memory, "7")[TABLE] > 0.9


def test_what_was_hidden_before_is_missed_when_its_spot_is_in_view():
    memory = make_memory()
    look(memory, TABLE, "mug")
    for _ in range(2 * MOST_LOOKS):
        memory.observe(TABLE, [], hidden=["mug"])
    assert memory.last_seen("mug").is_there
    look(memory, TABLE)
    assert not memory.last_seen("mug").is_there


def test_another_part_of_a_place_is_looked_into():
    memory = make_memory()
    memory.observe(DRAWER, [Sighting("fork", "in")])
    for _ in range(2 * MOST_LOOKS):
        memory.observe(DRAWER, [], {"in": 0, "onTop": 1})
    assert memory.last_seen("fork").is_there
    memory.observe(DRAWER, [], {"in": 1, "onTop": 0})
    assert not memory.last_seen("fork").is_there


def test_a_detector_that_flickers_for_an_hour_is_bounded_and_kept(tmp_path):
    memory = make_memory()
    for number in range(5 * MOST_KEPT):
        look(memory, TABLE, *(["mug", "pen"] if number % 2 else ["mug"]))
    assert len(memory._state.step.looks) <= MOST_KEPT
    look(memory, TABLE, "mug")
    memory.save(tmp_path / "home.sgm")
    other = SceneGraphMemory.load(tmp_path / "home.sgm")
    for one in (memory, other, memory.copy()):
        assert not one.last_seen("pen").is_there
        assert one.last_seen("mug").is_there
        assert json.dumps(one.to_dict()) == json.dumps(memory.to_dict())
        assert Finder(Adaptive()).rank(one, "pen") == Finder(Adaptive()).rank(memory, "pen")


@POLICIES
@pytest.mark.parametrize(
    ("name", "id"), [("mug", "7"), ("mug 3", None), ("kettle", None), ("toaster", None)]
)
def test_of_a_single_thing_the_later_place_wins(policy, name, id):
    """`last_seen` named the desk, `where_is` the shelf, and `rank` both with 97 %."""
    memory = make_memory()
    for place in (DESK, SHELF):
        memory.observe(place, [Sighting(name, id=id)])
    for steps in (0, 1):
        memory.step(steps)
        assert memory.last_seen(name).furniture == SHELF
        places = rank(memory, name, policy)
        assert max(places, key=places.get) == SHELF
        assert steps or places[SHELF] > 0.85 > 0.1 > places[DESK]
        assert next(iter(memory.list_seen()[0]))[1].furniture == SHELF
        (change,) = memory.changes(0)
        assert (change.kind, change.to_place) == ("new", SHELF)


@POLICIES
def test_of_several_things_the_last_place_comes_first(policy):
    """Of mugs there may be two: both are known, and all answers name the same one first."""
    for first, second in ((DESK, SHELF), (SHELF, DESK)):
        memory = make_memory()
        look(memory, first, "mug")
        look(memory, second, "mug")
        assert memory.last_seen("mug").furniture == second
        ranking = Finder(policy()).rank(memory, "mug")
        assert [place.furniture for place in ranking[:2]] == [second, first]
        assert ranking.last_seen.furniture == second
        assert ranking[1].probability > 0.9
        assert memory.list_seen()[0][0][1].furniture == second
        assert [event.furniture for event in memory.history("mug")] == [second, first]


def test_of_things_with_ids_the_one_seen_last_comes_first():
    memory = make_memory()
    memory.observe(DESK, [Sighting("mug", id="1")])
    memory.observe(SHELF, [Sighting("mug", id="2")])
    assert memory.last_seen("mug").furniture == SHELF
    memory.observe(DESK, [Sighting("mug", id="1")])
    assert memory.last_seen("mug").furniture == DESK


def test_two_in_one_look_are_two_wherever_one_is_seen_later():
    memory = make_memory()
    look(memory, DESK, "kettle", "kettle")
    look(memory, SHELF, "kettle")
    places = rank(memory, "kettle")
    assert places[DESK] > 0.9
    assert places[SHELF] > 0.9

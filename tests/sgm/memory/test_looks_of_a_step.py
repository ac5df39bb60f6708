"""Looks of one time step have an order: what they show last holds, whatever they show."""

import json

import pytest

from sgm.finder.finder import Finder
from sgm.memory.look import MOST_KEPT, MOST_LOOKS
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian, Frequentist

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
def test_what_shows_the_same_counts_once(times):
    memory = make_memory()
    look(memory, TABLE, "mug", times=times)
    look(memory, TABLE, times=times)
    look(memory, TABLE, "mug", "pen", times=times)
    assert memory.batch.furniture_num_observed[0, TABLE] == 1
    assert memory.last_seen("mug").times_seen == 1


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
    ("name", "id"),
    [("mug", None), ("mug", "7"), ("mug 3", None), ("kettle", None), ("toaster", None)],
)
def test_of_one_thing_the_later_place_wins(policy, name, id):
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
        ranking = Finder(policy()).rank(memory, name)
        assert ranking.num_known == 1
        assert sum(places.values()) + ranking.elsewhere == pytest.approx(1)


@POLICIES
@pytest.mark.parametrize("steps", [(0, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_what_is_seen_here_again_after_it_was_seen_there_is_two(policy, steps):
    """Never missed, and seen elsewhere meanwhile: none was moved away and back so soon."""
    memory = make_memory()
    for place, num_steps in zip((DESK, SHELF, DESK), steps, strict=True):
        memory.step(num_steps)
        look(memory, place, "mug")
    assert memory.last_seen("mug").furniture == DESK
    ranking = Finder(policy()).rank(memory, "mug")
    assert ranking.num_known == 2
    assert [place.furniture for place in ranking[:2]] == [DESK, SHELF]
    assert ranking[1].probability > (0.8 if sum(steps) == 0 else 0.5)
    assert ranking.last_seen.furniture == DESK


@pytest.mark.parametrize(
    ("places", "number"),
    [
        ([DESK, SHELF], 1),
        ([DESK, 1, SHELF, 1, DESK], 1),  # moved twice, in three steps
        ([DESK, SHELF, TABLE], 1),
        ([DESK, SHELF, 9, DESK, SHELF], 2),
    ],
)
def test_how_many_mugs_are_known(places, number):
    memory = make_memory()
    for place in places:
        if place in (1, 9):
            memory.step(place)
        else:
            look(memory, place, "mug")
    assert memory.ask(["mug"]).num_instances.tolist() == [number]


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


@pytest.mark.parametrize("policy", [Adaptive, Bayesian, Frequentist])
@pytest.mark.parametrize("shown", [[()], [(), ("pen",)], [("pen",), ("pen", "cup"), ("cup",)]])
@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("name", ["mug", "piano"])
def test_ten_looks_of_a_step_are_no_ten_days(policy, shown, alone, name):
    """Elsewhere went from 13 % to 85 % with the step after them."""
    beliefs = []
    for times in (1, 4 * MOST_LOOKS):
        memory = make_memory()
        look(memory, TABLE, "mug")
        memory.step(5)
        for number in range(max(times, len(shown))):
            for place in range(4):
                if alone:
                    memory.note_absent(place, name)
                else:
                    look(memory, place, *shown[number % len(shown)])
        for steps in (0, 1, 3):
            memory.step(steps)
            ranking = Finder(policy()).rank(memory, name)
            places = sorted((place.furniture, place.probability) for place in ranking)
            beliefs.append([*(value for _, value in places), ranking.elsewhere])
    once, often = beliefs[:3], beliefs[3:]
    for one, ten in zip(once, often, strict=True):
        assert ten == pytest.approx(one, abs=0.02)

"""Containers that must be opened to be looked into."""

from dataclasses import replace

import pytest

from sgm.finder.finder import Finder
from sgm.finder.search_plan import plan_search
from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from tests.sgm.finder.test_search_plan import make_places


def make_memory(**fridge):
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", kitchen, "white fridge", **fridge)
    memory.add_furniture("shelf", kitchen)
    memory.observe(0, [Sighting("milk", "in")])
    memory.observe(0, [Sighting("milk", "in"), Sighting("basket", "onTop")])
    memory.step(5)
    return memory


def test_a_shut_place_is_opened_later_if_that_costs_much_by_hand():
    shut, open_ = make_places(0.5, 0.4)
    shut = replace(shut, relation="in", open_cost=4.0)
    plan = plan_search("mug", [shut, open_])
    # open one first: 1 + .6 * 5 = 4; the shut one first: 5 + .5 * 1 = 5.5
    assert [look.place.furniture for look in plan] == [11, 10]
    assert [look.must_open for look in plan] == [False, True]
    assert [look.cost for look in plan] == [1, 5]
    assert plan.expected_cost == pytest.approx(4.0)
    cheap = plan_search("mug", [replace(shut, open_cost=0.1), open_])
    assert [look.place.furniture for look in cheap] == [10, 11]
    assert cheap.looks[0].cost == pytest.approx(1.1)


def test_another_look_on_the_spot_opens_nothing():
    (shut,) = make_places(0.9, detection=0.5)
    shut = replace(shut, relation="in", open_cost=2.0)
    plan = plan_search("mug", [shut], miss_again=0.5)
    assert [(look.cost, look.must_open) for look in plan] == [(3, True), (1, False), (1, False)]
    plan = plan_search("mug", [shut], miss_again=0.5, opened=10)
    assert [(look.cost, look.must_open) for look in plan] == [(1, False)] * 3


def test_the_plan_says_open_the_fridge():
    memory = make_memory(open_cost=3.0)
    finder = Finder(Bayesian())
    plan = finder.search_plan(memory, "milk")
    assert plan.looks[0].instruction == "open the white fridge in kitchen"
    assert "  1. open the white fridge in kitchen, " in str(plan)
    assert plan.looks[0].cost == 4.0
    assert plan.looks[1].instruction.endswith("the shelf in kitchen")
    looks = finder.search_plan(memory, "basket")
    (basket,) = (look for look in looks if look.place.furniture == 0)
    assert (basket.instruction, basket.cost) == ("look on the white fridge in kitchen", 1.0)


def test_a_box_with_a_door_must_be_opened_at_no_cost():
    memory = make_memory(box=Box((0, 0, 0.9), (0.6, 0.6, 1.8), 0.0, "door"))
    place = Finder(Bayesian()).rank(memory, "milk")[0]
    assert place.open_cost == 0.0
    look = Finder(Bayesian()).search_plan(memory, "milk").looks[0]
    assert (look.must_open, look.cost) == (True, 1.0)


def test_without_doors_all_is_as_before():
    memory = make_memory()
    look = Finder(Bayesian()).search_plan(memory, "milk").looks[0]
    assert (look.must_open, look.cost, look.place.open_cost) == (False, 1.0, None)
    assert look.instruction == "look in the white fridge in kitchen"


def test_a_search_opens_once_and_counts_what_was_in_view():
    memory = make_memory(open_cost=3.0)
    search = Finder(Bayesian()).search(memory, "milk", budget=6.0)
    first = search.next()
    assert (first.must_open, first.cost) == (True, 4.0)
    assert not search.seen([], {"in": 0.3, "onTop": 1})
    second = search.next()
    if second.place.furniture == 0:
        assert (second.must_open, second.cost) == (False, 1.0)
    assert search.cost == 4.0
    assert not search.seen([])
    assert search.next() is None or search.cost <= 6.0


def test_a_search_may_look_at_a_shut_place_without_opening_it():
    """Then nothing is counted, and it goes there again; the number of looks ends it."""
    memory = make_memory(open_cost=3.0)
    before = Finder(Bayesian()).rank(memory, "milk")[0].probability
    search = Finder(Bayesian()).search(memory, "milk")
    while (look := search.next()) is not None:
        search.seen([], {"in": 0, "onTop": 1} if look.place.furniture == 0 else 1.0)
    assert search.num_looks <= 6
    assert Finder(Bayesian()).rank(memory, "milk")[0].probability > before - 0.05


def test_a_budget_pays_for_doors():
    memory = make_memory(open_cost=3.0)
    finder = Finder(Bayesian())
    search = finder.search(memory, "milk", budget=3.5, give_up_at=0.99)
    assert search.next().place.furniture == 1  # the fridge would cost 4
    search = finder.search(memory, "milk", budget=3.5)
    assert search.next() is None  # the shelf alone finds it with less than .1
    assert "budget of 3.5 too small for white fridge" in search.outcome
    assert finder.search(memory, "milk", budget=4.0).next().place.furniture == 0

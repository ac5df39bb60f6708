"""Search plans: worked by hand, and never worse than going greedily."""

import itertools

import numpy as np
import pytest

from sgm.finder.ranking import Place
from sgm.finder.reasons import Evidence
from sgm.finder.search_plan import EXACT_PLACES, plan_search


def make_places(*probability: float) -> list[Place]:
    """Places of furniture 10, 11, ... with these probabilities."""
    no_evidence = Evidence(None, 0, (), 0.0)
    return [
        Place(10 + number, f"place {number}", "onTop", value, no_evidence)
        for number, value in enumerate(probability)
    ]


def test_without_distances_the_likeliest_comes_first():
    plan = plan_search("mug", make_places(0.2, 0.5, 0.1))
    assert [look.place.furniture for look in plan] == [11, 10, 12]
    # 1 look, with 1 - .5 = .5 a second, with .5 - .2 = .3 a third
    assert plan.expected_cost == pytest.approx(1.8)
    assert plan.found == pytest.approx(0.8)
    assert str(plan).splitlines()[0] == "mug: found with 80%, expected cost 1.8"


def test_a_near_place_comes_before_a_likelier_far_one():
    # Near .4 at 1 m, far .6 at 4 m, 5 m between them, a look costs 2: near first 3 + .6 * 7 = 7.2,
    # far first 6 + .4 * 7 = 8.8.
    metres = {("door", 10): 1, ("door", 11): 4, (10, 11): 5, (11, 10): 5, (10, 10): 0, (11, 11): 0}
    plan = plan_search(
        "mug", make_places(0.4, 0.6), "door", lambda here, there: metres[here, there], 2.0
    )
    assert [look.place.furniture for look in plan] == [10, 11]
    assert [look.cost for look in plan] == [3, 7]
    assert [look.prob_needed for look in plan] == pytest.approx([1, 0.6])
    assert plan.expected_cost == pytest.approx(7.2)


def compute_cost(order, prob, at) -> float:
    """Expected way along points of a plane, from the origin."""
    cost, missing, here = 0.0, 1.0, np.zeros(2)
    for place in order:
        cost += missing * np.linalg.norm(at[place] - here)
        missing -= prob[place]
        here = at[place]
    return cost


def make_distance(at):
    def distance(here, there):
        start = np.zeros(2) if here == "start" else at[here - 10]
        return float(np.linalg.norm(at[there - 10] - start))

    return distance


def test_few_places_are_planned_exactly():
    rng = np.random.default_rng(0)
    for _ in range(20):
        prob, at = rng.dirichlet(np.ones(6))[:5], rng.uniform(-9, 9, (5, 2))
        plan = plan_search("mug", make_places(*prob), "start", make_distance(at), 0.0)
        best = min(compute_cost(order, prob, at) for order in itertools.permutations(range(5)))
        assert plan.expected_cost == pytest.approx(best)


def test_many_places_are_never_worse_than_greedy():
    rng = np.random.default_rng(1)
    better = 0
    for _ in range(5):
        number = EXACT_PLACES + 11
        prob, at = rng.dirichlet(np.ones(number + 1))[:-1], rng.uniform(-9, 9, (number, 2))
        plan = plan_search("mug", make_places(*prob), "start", make_distance(at), 0.0)
        order = [look.place.furniture - 10 for look in plan]
        assert sorted(order) == list(range(number))
        assert plan.expected_cost == pytest.approx(compute_cost(order, prob, at))
        rest, here, greedy = list(range(number)), np.zeros(2), []
        while rest:
            greedy.append(max(rest, key=lambda p: prob[p] / np.linalg.norm(at[p] - here)))
            rest.remove(greedy[-1])
            here = at[greedy[-1]]
        cost = compute_cost(greedy, prob, at)
        assert plan.expected_cost <= cost + 1e-9
        better += plan.expected_cost < cost - 1e-9
    assert better >= 1


def test_nowhere_to_look():
    plan = plan_search("mug", [], "start", lambda here, there: 1.0)
    assert (len(plan), plan.expected_cost, plan.found) == (0, 0, 0)


def test_places_that_cannot_be_reached_are_left_out():
    # From the door 1 to place 10 and 2 to place 12, none to 11; from 10 to 12 none but by the door.
    cost = {("door", 10): 1.0, ("door", 11): np.inf, ("door", 12): 2.0}
    plan = plan_search(
        "mug", make_places(0.5, 0.3, 0.2), "door", lambda a, b: cost.get((a, b), np.inf), 0.0
    )
    assert [look.place.furniture for look in plan] == [10, 12]
    assert plan.found == pytest.approx(0.7)
    assert plan.expected_cost == pytest.approx(1 + 0.5 * (1 + 2))


def test_bad_costs_are_named():
    with pytest.raises(ValueError, match=r"distance from 'door' to 10 must be .* got -1"):
        plan_search("mug", make_places(0.5), "door", lambda here, there: -1)
    with pytest.raises(ValueError, match=r"distance from None to 10 must be a number, .* got nan"):
        plan_search("mug", make_places(0.5), None, lambda here, there: float("nan"))
    with pytest.raises(ValueError, match=r"look_cost must be a finite number, 0 or more, got nan"):
        plan_search("mug", make_places(0.5), look_cost=float("nan"))
    with pytest.raises(ValueError, match=r"start must come with distances, got start='door' alone"):
        plan_search("mug", make_places(0.5), start="door")

"""How far plans are from the least expected cost, by an exact solver of another kind."""

import numpy as np
import pytest

from sgm.finder.evidence import Evidence
from sgm.finder.ranking import Place
from sgm.finder.search_plan import MOST_PLANNED, plan_search
from sgm.finder.travel_costs import TravelCosts

START = "start"


def solve(prob, first, legs):
    """Least expected costs of n cases of K places, (n, K), (n, K), (n, K, K) -> (n,).

    Forwards, by what has been spent: a set of places that was visited, and the last one of them.
    """
    num_cases, num_places = prob.shape
    prob, first, legs = prob.T.copy(), first.T.copy(), legs.transpose(1, 2, 0).copy()
    spent = np.full((1 << num_places, num_places, num_cases), np.inf)
    for place in range(num_places):
        spent[1 << place, place] = first[place]
    for been in range(1, (1 << num_places) - 1):
        is_in = [place for place in range(num_places) if been >> place & 1]
        out = [place for place in range(num_places) if not been >> place & 1]
        missing = 1 - prob[is_in].sum(axis=0)
        further = spent[been, is_in][:, None] + missing * legs[np.ix_(is_in, out)]
        spent[[been | 1 << place for place in out], out] = further.min(axis=0)
    return spent[-1].min(axis=0)


def sample_case(rng, kind, num_places):
    """Probabilities, and costs from each place to each, the last one the start, with a look."""
    spread = rng.choice([0.1, 0.3, 1.0, 3.0])
    prob = rng.dirichlet(np.full(num_places + 1, spread))[:num_places]
    if rng.random() < 0.3:
        prob /= prob.sum()  # surely at one of them
    at = rng.uniform(0, 18, (num_places + 1, 2))
    if kind == "rooms":
        at = rng.uniform(0, 18, (4, 2))[rng.integers(0, 4, num_places + 1)]
        at += rng.normal(0, 0.5, at.shape)
    cost = np.linalg.norm(at[:, None] - at, axis=2)
    if kind == "one way":  # there and back are not alike
        cost *= rng.uniform(0.7, 1.5, cost.shape)
    if kind == "doors":
        cost += rng.choice([0.0, 5.0], num_places + 1) * ~np.eye(num_places + 1, dtype=bool)
    return prob, cost, float(rng.choice([0.0, 1.0, 3.0]))


def list_places(prob):
    nothing = Evidence(None, 0, (), 0.0)
    return [Place(n, f"place {n}", "in", float(one), nothing) for n, one in enumerate(prob)]


def plan(prob, cost, look_cost):
    return plan_search(
        "mug", list_places(prob), START, lambda a, b: cost[-1 if a == START else a, b], look_cost
    )


def compute_ratios(kind, num_places, num_cases, seed=0):
    """Expected costs of plans, by the least ones, (n,)."""
    rng = np.random.default_rng(seed)
    cases = [sample_case(rng, kind, num_places) for _ in range(num_cases)]
    found = [plan(*case).expected_cost for case in cases]
    prob = np.array([case[0] for case in cases])
    legs = np.array([cost + look_cost for _, cost, look_cost in cases])
    return np.array(found) / solve(prob, legs[:, -1, :-1], legs[:, :-1, :-1])


KINDS = pytest.mark.parametrize("kind", ["anywhere", "rooms", "one way", "doors"])


@pytest.mark.slow
@KINDS
@pytest.mark.parametrize(("num_places", "num_cases"), [(3, 25), (9, 25), (12, 100)])
def test_up_to_twelve_places_have_the_least_cost(kind, num_places, num_cases):
    np.testing.assert_allclose(compute_ratios(kind, num_places, num_cases), 1)


@pytest.mark.slow
@KINDS
def test_more_places_are_near_the_least_cost(kind):
    ratios = compute_ratios(kind, 14, 50)
    assert ratios.min() > 1 - 1e-9
    assert ratios.mean() < 1.005
    assert np.mean(ratios < 1.01) >= 0.9


def make_building(seed, num_places):
    """Likely places far away, and many that hold next to nothing near the start."""
    rng = np.random.default_rng(seed)
    prob = 1e-6 * rng.random(num_places)
    prob[rng.choice(num_places, 40, replace=False)] = rng.dirichlet(np.ones(40)) * 0.9
    return prob, rng.uniform(0, 300, (num_places + 1, 2))


def note_ways(at):
    """Straight lines between points, the last one the start, and a list of those asked for."""
    asked = []

    def distance(here, there):
        asked.append((here, there))
        return float(np.linalg.norm(at[-1 if here == START else here] - at[there]))

    return distance, asked


def test_what_holds_next_to_nothing_is_left_out_and_its_ways_are_not_asked_for():
    prob, at = make_building(0, 1000)
    places, (distance, asked) = list_places(prob), note_ways(at)
    whole = plan_search("mug", places, START, distance)
    assert whole.found == pytest.approx(prob.sum(), rel=1e-3)
    assert len(whole) < 200  # 96 at least
    assert len(asked) < 100 * 100 + 100 * 10
    # As if there were no other places: none of those that are left out would be looked at first.
    few = [place for place in places if place.probability > 1e-5]
    alone = plan_search("mug", few, START, distance)
    looks = [look.place.furniture for look in alone]
    assert [look.place.furniture for look in whole][: len(looks) // 2] == looks[: len(looks) // 2]


def test_ways_that_are_kept_are_asked_for_once():
    prob, at = make_building(1, 200)
    places, (distance, asked) = list_places(prob), note_ways(at)
    ways = TravelCosts(distance)
    first = plan_search("mug", places, START, ways, miss_again=0.2, most=1)
    assert len(set(asked)) == len(asked)
    again = plan_search("mug", places, START, ways, miss_again=0.2, most=1)
    assert len(set(asked)) == len(asked)
    assert again == first
    assert len(first) == 1
    whole = plan_search("mug", places, START, ways, miss_again=0.2)
    assert whole.looks[0] == first.looks[0]


def test_more_looks_than_are_planned_together_follow_one_another():
    """All places are alike: each is looked at once, and the way is no salesman's nightmare."""
    num_places = 3 * MOST_PLANNED
    rng = np.random.default_rng(2)
    at = rng.uniform(0, 100, (num_places + 1, 2))
    cost = np.linalg.norm(at[:, None] - at, axis=2)
    whole = plan(np.full(num_places, 0.9 / num_places), cost, 1.0)
    assert sorted(look.place.furniture for look in whole) == list(range(num_places))
    # .7124 sqrt(n A) is the shortest way through random points (Beardwood et al. 1959).
    assert sum(look.cost - 1 for look in whole) < 2 * 0.7124 * np.sqrt(num_places * 100**2)

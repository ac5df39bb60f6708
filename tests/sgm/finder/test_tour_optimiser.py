"""Tours: worked by hand, and equal to trying all orders."""

import itertools

import numpy as np
import pytest

from sgm.finder.tour_optimiser import compute_tour_costs, plan_tour


def compute_expected_cost(prob, first_leg, legs, order) -> float:
    cost, missing, last = 0.0, 1.0, None
    for place in order:
        cost += missing * (first_leg[place] if last is None else legs[last, place])
        missing -= prob[place]
        last = place
    return cost


def find_best_tour(prob, first_leg, legs) -> tuple[int, ...]:
    """The cheapest tour, by trying all orders."""
    orders = itertools.permutations(range(len(prob)))
    return min(orders, key=lambda order: compute_expected_cost(prob, first_leg, legs, order))


def test_costs_worked_by_hand():
    # Place 1 first: 4, then with 1 - .5 = .5 to place 0: 3, then with .5 - .3 = .2 to place 2: 10.
    prob, first_leg = np.array([0.3, 0.5, 0.1]), np.array([9.0, 4.0, 9.0])
    legs = np.array([[0.0, 1.0, 10.0], [3.0, 0.0, 7.0], [1.0, 1.0, 0.0]])
    cost, prob_needed = compute_tour_costs(prob, first_leg, legs, np.array([1, 0, 2]))
    assert cost.tolist() == [4, 3, 10]
    assert prob_needed == pytest.approx([1, 0.5, 0.2])
    assert cost @ prob_needed == pytest.approx(4 + 1.5 + 2)


def test_a_place_on_the_way_comes_before_a_likelier_one():
    # Near .4 at 1, far .6 at 4, 5 between them:
    # far first 4 + .4 * 5 = 6, near first 1 + .6 * 5 = 4.
    order = plan_tour(
        np.array([[0.4, 0.6]]), np.array([[1.0, 4.0]]), np.array([[[0.0, 5.0], [5.0, 0.0]]]),
        np.ones((1, 2), dtype=bool),
    )  # fmt: skip
    assert order.tolist() == [[0, 1]]


def test_tours_equal_trying_all_orders():
    rng = np.random.default_rng(0)
    prob = rng.dirichlet(np.ones(6), size=40)[:, :5]
    first_leg = rng.uniform(0, 20, (40, 5))
    legs = rng.uniform(0, 20, (40, 5, 5))
    tours = plan_tour(prob, first_leg, legs, np.ones((40, 5), dtype=bool))
    for case, tour in zip(zip(prob, first_leg, legs, strict=True), tours, strict=True):
        assert tuple(tour) == find_best_tour(*case)


def test_closed_places_come_last():
    rng = np.random.default_rng(1)
    for _ in range(40):
        prob, first_leg = rng.dirichlet(np.ones(6)), rng.uniform(0, 20, 6)
        legs = rng.uniform(0, 20, (6, 6))
        is_open = rng.random(6) < 0.6
        is_open[rng.integers(6)] = True
        left = np.flatnonzero(is_open)
        prob = np.where(is_open, prob, 0.0)
        best = find_best_tour(prob[left], first_leg[left], legs[np.ix_(left, left)])
        (tour,) = plan_tour(prob[None], first_leg[None], legs[None], is_open[None])
        assert tour[: len(left)].tolist() == left[list(best)].tolist()
        assert sorted(tour) == list(range(6))

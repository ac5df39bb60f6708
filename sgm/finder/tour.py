"""Tours with little expected cost until what is looked for is found: exact, greedy, improved."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

MOST_IMPROVED = 24  # first looks of a tour whose order may be changed
_LONGEST = 3  # looks of the shorter of two runs that are exchanged


def plan_tour(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, is_open: np.ndarray
) -> np.ndarray:
    """Return the tours with the least expected cost until found, exactly, (n, K) places in order.

    A tour k_1, k_2, ... costs the sum over its legs of the leg's cost x P(not found before it). The
    best one is found by dynamic programming over sets of places visited: work grows as 2^K.

    Args:
        prob: probability that the object is at each place, (n, K); sums to at most one.
        first_leg: cost of going to each place from here and looking, (n, K).
        legs: cost of going from place to place and looking, (n, K, K).
        is_open: places that may be visited, bool (n, K), some in each row; the others come last.
    """
    num_tours, num_places = prob.shape
    never = 1e9  # finite: times a probability of zero it is zero
    first_leg = np.where(is_open, first_leg, np.inf)
    # Closed places are left out by visiting them for nothing at the end: no probability, no leg.
    prob = np.where(is_open, prob, 0.0)
    legs = np.where(is_open[:, None, :], legs, 0.0)
    legs = np.where(is_open[:, :, None] | ~is_open[:, None, :], legs, never)
    num_sets = 1 << num_places
    is_in = (np.arange(num_sets)[:, None] >> np.arange(num_places)) & 1 == 1  # (S, K)
    missing = np.maximum(1 - prob @ is_in.T, 0)  # P(not found after visiting the set), (n, S)
    # Cost to go after visiting a set with its last place, (n, S, K); the full set is the end.
    togo = np.zeros((num_tours, num_sets, num_places))
    following = np.zeros((num_tours, num_sets, num_places), dtype=np.int64)
    places = np.arange(num_places)
    for num_visited in range(num_places - 1, 0, -1):  # sets of one size at once, (V,)
        sets = np.flatnonzero(is_in.sum(axis=1) == num_visited)
        ahead = togo[:, sets[:, None] | 1 << places, places]  # (n, V, K), by the next place
        after = missing[:, sets, None, None] * legs[:, None] + ahead[:, :, None]  # (n, V, K, K)
        after[:, is_in[sets][:, None, :].repeat(num_places, axis=1)] = np.inf
        following[:, sets] = after.argmin(axis=3)
        togo[:, sets] = after.min(axis=3)
    single = togo[:, 1 << np.arange(num_places), np.arange(num_places)]  # (n, K)
    order = np.zeros((num_tours, num_places), dtype=np.int64)
    order[:, 0] = np.argmin(first_leg + single, axis=1)
    been, tours = 1 << order[:, 0], np.arange(num_tours)
    for turn in range(1, num_places):
        order[:, turn] = following[tours, been, order[:, turn - 1]]
        been |= 1 << order[:, turn]
    return order


def compute_tour_costs(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, order: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost of each leg of tours, and the probability that it is needed, (..., k) each.

    Their product summed up is the expected cost. `order` has the places of the tours, (..., k); the
    rest is as in `plan_tour`, for one tour.
    """
    cost = np.concatenate(
        [first_leg[order[..., :1]], legs[order[..., :-1], order[..., 1:]]], axis=-1
    )
    return cost, compute_prob_needed(prob[order])


def compute_prob_needed(found: np.ndarray) -> np.ndarray:
    """Return how likely each look is needed, of looks that find it first with `found`, (..., k)."""
    prob_needed: np.ndarray = np.maximum(1 - np.cumsum(found, axis=-1) + found, 0)
    return prob_needed


def compute_expected_cost(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, order: np.ndarray
) -> np.ndarray:
    """Return the expected cost of tours, (...); arguments as in `compute_tour_costs`."""
    cost, prob_needed = compute_tour_costs(prob, first_leg, legs, order)
    expected: np.ndarray = (cost * prob_needed).sum(axis=-1)
    return expected


def order_greedily(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, begin: Sequence[int] = ()
) -> np.ndarray:
    """Go on with the best probability per cost of the next leg, (K,) looks in order."""
    order = list(begin)
    is_left = np.ones(len(prob), dtype=bool)
    is_left[order] = False
    while len(order) < len(prob):
        cost = legs[order[-1]] if order else first_leg
        promise = np.where(is_left, prob / np.maximum(cost, 1e-9), -1.0)
        order.append(int(promise.argmax()))
        is_left[order[-1]] = False
    return np.array(order, dtype=np.int64)


def improve_begin(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, order: np.ndarray
) -> np.ndarray:
    """Return a tour (K,) whose first `MOST_IMPROVED` looks no small change makes cheaper.

    A change exchanges two runs of looks that follow one another, one of them of `_LONGEST` at most,
    each as it is or turned round; one of them may be empty. The best is made, until none is.

    With m missing before a run of legs l_1, l_2, ..., it costs m D - E, where D is the sum of the
    legs and E that of each times what the run holds before it. Both are differences of two
    cumulative sums over the tour.
    """
    order = order.copy()
    num = min(len(order), MOST_IMPROVED)
    begin, middle, end = _list_runs(num)
    if not len(begin):
        return order
    while True:
        costs = _compute_changes(prob, first_leg, legs, order, num)
        best = int(costs.argmin())
        if not costs.flat[best] < -1e-12:
            return order
        turned, run = divmod(best, len(begin))
        i, j, k = int(begin[run]), int(middle[run]), int(end[run])
        one, two = order[i:j], order[j:k]
        one, two = one[:: -1 if turned & 1 else 1], two[:: -1 if turned & 2 else 1]
        order[i:k] = np.concatenate([two, one])


def _compute_changes(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, order: np.ndarray, num: int
) -> np.ndarray:
    """Return by how much each change makes a tour dearer, (4, n), by which runs are turned round.

    Neither, the first one, the second one, both.
    """
    begin, middle, end = _list_runs(num)
    own = order[: num + 1]  # with the one that follows
    held = np.append(0.0, np.cumsum(prob[own]))  # before each look
    first = np.zeros((len(legs) + 2, len(legs) + 2))  # from here, and to nowhere
    first[:-2, :-2], first[-2, :-2] = legs, first_leg
    legs, own = first, np.append(own, -1) if len(own) == num else own

    def sum_up(leg: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums of legs to the looks 1, 2, ..., and of each times what is held before."""
        return (
            np.concatenate([[0.0, 0.0], np.cumsum(leg)]),
            np.concatenate([[0.0, 0.0], np.cumsum(leg * before)]),
        )

    there, by_there = sum_up(legs[own[: num - 1], own[1:num]], held[1:num])
    back, by_back = sum_up(legs[own[1:num], own[: num - 1]], held[1:num])

    def run(start: np.ndarray, stop: np.ndarray, is_turned: bool) -> tuple[np.ndarray, ...]:
        """Sum of the legs, what is saved of it by what the run holds, its first and last look."""
        start = np.minimum(start, num - 1)  # an empty one at the end
        last = np.maximum(stop - 1, start)
        if is_turned:
            length = back[last + 1] - back[start + 1]
            saved = held[stop] * length - (by_back[last + 1] - by_back[start + 1])
            return length, saved, own[last], own[start]
        length = there[last + 1] - there[start + 1]
        saved = by_there[last + 1] - by_there[start + 1] - held[start] * length
        return length, saved, own[start], own[last]

    come_from = np.append(-2, own)[begin]
    go_to = own[end]
    missing, held_by_one = 1 - held[begin], held[middle] - held[begin]
    held_by_two = held[end] - held[middle]
    has_two = end > middle

    def compute(one: tuple[np.ndarray, ...], two: tuple[np.ndarray, ...]) -> np.ndarray:
        """Cost of the second run and then the first, with the ways to, between and from them."""
        between = np.where(has_two, legs[two[3], one[2]], 0.0)
        to = legs[come_from, np.where(has_two, two[2], one[2])]
        rest = missing - held_by_two
        cost: np.ndarray = (
            missing * (to + np.where(has_two, two[0], 0.0))
            - np.where(has_two, two[1], 0.0)
            + rest * (between + one[0])
            - one[1]
            + (rest - held_by_one) * legs[one[3], go_to]
        )
        return cost

    turned_one, turned_two = run(begin, middle, True), run(middle, end, True)
    as_one, as_two = run(begin, middle, False), run(middle, end, False)
    rest = missing - held_by_one
    now = (
        missing * (legs[come_from, as_one[2]] + as_one[0])
        - as_one[1]
        + np.where(
            has_two,
            rest * (legs[as_one[3], as_two[2]] + as_two[0])
            - as_two[1]
            + (rest - held_by_two) * legs[as_two[3], go_to],
            rest * legs[as_one[3], go_to],
        )
    )
    pairs = ((as_one, as_two), (turned_one, as_two), (as_one, turned_two), (turned_one, turned_two))
    return np.stack([compute(*pair) - now for pair in pairs])


@lru_cache(maxsize=MOST_IMPROVED)
def _list_runs(number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List where two runs that follow one another begin, meet and end, (n,) each."""
    found = [
        (i, j, k)
        for i in range(number)
        for j in range(i + 1, number + 1)
        for k in range(j, number + 1)
        if min(j - i, k - j) <= _LONGEST
    ]
    begin, middle, end = np.array(found, dtype=np.int64).reshape(-1, 3).T
    return begin, middle, end

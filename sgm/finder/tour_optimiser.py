"""Tours with little expected cost until what is looked for is found: exact, greedy, improved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

MOST_IMPROVED = 24  # first looks of a tour whose order may be changed
_LONGEST = 3  # looks of the shorter of two runs that are exchanged
_ALIKE = 1e-12  # costs that differ by less are equal: on any processor the same plan
_HERE, _NOWHERE = -2, -1  # where a tour begins, and after its last look, in tables of legs


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
    """
    order = order.copy()
    num = min(len(order), MOST_IMPROVED)
    begin, middle, end = _list_runs(num)
    if not len(begin):
        return order
    while True:
        costs = _compute_changes(_Begin(prob, first_leg, legs, order, num))
        if not costs.min() < -_ALIKE:
            return order
        best = int((costs <= costs.min() + _ALIKE).argmax())  # of equal ones, the first
        turned, run = divmod(best, len(begin))
        i, j, k = int(begin[run]), int(middle[run]), int(end[run])
        first, second = order[i:j], order[j:k]
        first, second = first[:: -1 if turned & 1 else 1], second[:: -1 if turned & 2 else 1]
        order[i:k] = np.concatenate([second, first])


def _compute_changes(tour: _Begin) -> np.ndarray:
    """Return by how much each change makes a tour dearer, (4, n), by which runs are turned round.

    Neither, the first one, the second one, both.
    """
    begin, middle, end = _list_runs(tour.num)
    first_runs, turned_first = (tour.get_runs(begin, middle, turned) for turned in (False, True))
    second_runs, turned_second = (tour.get_runs(middle, end, turned) for turned in (False, True))

    def compute(first: _Runs, second: _Runs) -> np.ndarray:
        """Cost of two runs and of the ways to, between and from them; one may be empty."""
        missing = 1 - tour.held[begin]
        others = missing - first.held
        come_from, go_to = np.append(_HERE, tour.looks)[begin], tour.looks[end]
        legs, is_first, is_second = tour.legs, first.is_any, second.is_any
        to = legs[come_from, np.where(is_first, first.first, second.first)]
        between = np.where(is_first & is_second, legs[first.last, second.first], 0.0)
        onward = legs[np.where(is_second, second.last, first.last), go_to]
        cost: np.ndarray = (
            missing * (to + first.way)
            - first.saved
            + others * (between + second.way)
            - second.saved
            + (others - second.held) * onward
        )
        return cost

    now = compute(first_runs, second_runs)
    pairs = (
        (second_runs, first_runs),
        (second_runs, turned_first),
        (turned_second, first_runs),
        (turned_second, turned_first),
    )
    return np.stack([compute(*pair) - now for pair in pairs])


@dataclass(frozen=True, slots=True)
class _Runs:
    """Runs of looks that follow one another, (n,) each.

    Attributes:
        is_any: whether it has a look.
        first, last: its looks at both ends; any look where it has none.
        held: probability that one of its looks finds it.
        way: sum of its legs; 0 where it has no look.
        saved: sum of its legs, each times what is held by the looks of the run before it. So it
            costs m way - saved, where m is missing before it.
    """

    is_any: np.ndarray
    first: np.ndarray
    last: np.ndarray
    held: np.ndarray
    way: np.ndarray
    saved: np.ndarray


class _Begin:
    """The first looks of a tour, and sums whose differences say what any run of them costs.

    Attributes:
        num: how many looks, n.
        looks: the looks, and the one that follows or `_NOWHERE`, (n + 1,).
        legs: between looks, from `_HERE` to looks, and to `_NOWHERE`.
        held: by the looks before each, (n + 1,).
    """

    def __init__(
        self,
        prob: np.ndarray,
        first_leg: np.ndarray,
        legs: np.ndarray,
        order: np.ndarray,
        num: int,
    ) -> None:
        """Take `num` looks of a tour (K,); the rest is as in `plan_tour`, for one tour."""
        self.num = num
        self.looks = np.append(order, _NOWHERE)[: num + 1]
        self.held = np.append(0.0, np.cumsum(prob[order[:num]]))
        self.legs = np.zeros((len(legs) + 2, len(legs) + 2))
        self.legs[:_HERE, :_HERE], self.legs[_HERE, :_HERE] = legs, first_leg
        ahead, behind = self.looks[: num - 1], self.looks[1:num]
        self._sums = self._sum_up(self.legs[ahead, behind])
        self._sums_turned = self._sum_up(self.legs[behind, ahead])

    def _sum_up(self, leg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return sums of n - 1 legs up to each look, and of each times what is held before it."""
        ways, by_held = np.cumsum(leg), np.cumsum(leg * self.held[1 : self.num])
        return np.append([0.0, 0.0], ways), np.append([0.0, 0.0], by_held)

    def get_runs(self, start: np.ndarray, stop: np.ndarray, is_turned: bool) -> _Runs:
        """Return the runs from looks to before others, (n,), as they are or turned round."""
        is_any = stop > start
        held = self.held[stop] - self.held[start]
        start = np.minimum(start, self.num - 1)  # an empty one at the end
        last = np.maximum(stop - 1, start)
        ways, by_held = self._sums_turned if is_turned else self._sums
        way = ways[last + 1] - ways[start + 1]
        by_held = by_held[last + 1] - by_held[start + 1]
        saved = self.held[stop] * way - by_held if is_turned else by_held - self.held[start] * way
        ends = self.looks[start], self.looks[last]
        first, last = ends[::-1] if is_turned else ends
        return _Runs(is_any, first, last, held, way * is_any, saved * is_any)


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

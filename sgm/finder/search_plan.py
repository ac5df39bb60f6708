"""In which order to look for something, given where it may be and how far that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.checks import is_number
from sgm.finder.ranking import Place
from sgm.layout.furniture import read_position
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten

MOST_ROUNDS = 3  # looks at one place: a detector that misses a quarter misses 2 % thrice
# (from, to) -> cost of the way; `from` is the start or a furniture id, `to` a furniture id.
Distance = Callable[[Any, int], float]

EXACT_PLACES = 9  # looks planned exactly: 10 ms; each further one takes twice as long


@dataclass(frozen=True, slots=True)
class Look:
    """One look of a plan.

    Attributes:
        place: where, with the probability that the object is there, and that a look shows it.
        cost: of going there from the place before, opening it, if it has to be, and looking.
        prob_needed: probability that the object was not found before.
        must_open: whether it has to be opened to look into it; not for another look at a place
            where one stands.
    """

    place: Place
    cost: float
    prob_needed: float
    must_open: bool = False

    @property
    def instruction(self) -> str:
        """What to do there: "open the white fridge in kitchen", "look on the table in hall"."""
        if self.must_open:
            return f"open the {self.place.name}"
        return f"look {'in' if self.place.relation == 'in' else 'on'} the {self.place.name}"


@dataclass(frozen=True, slots=True)
class SearchPlan:
    """An order of looks; it iterates over them.

    Attributes:
        description: what is looked for.
        looks: in order.
        expected_cost: mean cost until the object is found or all looks are spent, in the unit of
            the distances; without distances, the number of looks.
        found: probability that one of the looks finds it.
    """

    description: str
    looks: tuple[Look, ...]
    expected_cost: float
    found: float

    def __iter__(self) -> Iterator[Look]:
        """Iterate over the looks."""
        return iter(self.looks)

    def __len__(self) -> int:
        """Return the number of looks."""
        return len(self.looks)

    def __str__(self) -> str:
        """Say one look per line."""
        head = f"{self.description}: found with {self.found:.0%}, expected cost "
        lines = [f"{head}{self.expected_cost:.1f}"]
        for number, look in enumerate(self.looks, start=1):
            name = f"open the {look.place.name}" if look.must_open else look.place.name
            lines.append(f"{number:3}. {name}, {look.place.probability:.0%}, cost {look.cost:.1f}")
        return "\n".join(lines)


def plan_search(
    description: str,
    places: Sequence[Place],
    start: Any = None,
    distance: Distance | None = None,
    look_cost: float = 1.0,
    miss_again: float | None = None,
    opened: int | None = None,
) -> SearchPlan:
    """Order looks so that the expected cost until the object is found is small.

    The k-th look at a place is the first that finds the object with probability p d a^(k - 1). It
    is there with p, and a look shows it with d (`Place.detection`). Each look that misses it leaves
    the share a (`Detector.miss_again`) of what the next one can find.

    Two orders are made, and the cheaper one is taken: the best gain per cost of the next leg first;
    and the exact optimum over the `EXACT_PLACES` most promising looks, followed by the others in
    the first manner. With so few looks or fewer, and without distances, it is the optimum.

    What must be opened (`Place.open_cost`) is shut again when one leaves: it costs to be opened
    with every way that leads to it, and not for another look on the spot.

    Args:
        description: what is looked for.
        places: where it may be, with probabilities that sum to at most one.
        start: where the search starts, as `distance` understands it.
        distance: cost of the way, `distance(start, furniture)` and `distance(furniture, furniture)`
            with furniture ids; infinite where there is no way: such places are left out; None if
            only looks cost. It is not asked for the way from a place to itself, which is none.
        look_cost: of one look, in the unit of the distances.
        miss_again: a above; each place is then looked at `MOST_ROUNDS` times, in the order that
            costs least where one of these looks finds it. None for one look each.
        opened: furniture id of what is open now; None for none.

    Raises:
        ValueError: if a cost is negative or nan, or there is a start without distances.

    Source: Kadane (1968), "Discrete search and the Neyman-Pearson lemma": without ways between the
    places, the best gain per cost first is the optimum, since gains of a place fall.
    """
    if distance is None and start is not None:
        raise ValueError(
            f"start must come with distances, got start={shorten(start)} alone. Give distance=, a "
            "function of (start or furniture id, furniture id)."
        )
    if not is_number(look_cost) or not 0 <= look_cost < np.inf:
        raise ValueError(
            f"look_cost must be a finite number, 0 or more, got {shorten(look_cost)}. Give the "
            "cost of a look in the unit of the distances."
        )
    ways = [compute_way(distance, start, place.furniture) for place in places]
    first_leg = np.array(ways)  # (K,)
    is_near = np.isfinite(first_leg)
    places = [place for place, near in zip(places, is_near, strict=True) if near]
    first_leg = first_leg[is_near]
    ids = [place.furniture for place in places]
    legs = np.array([[compute_way(distance, at, to) for to in ids] for at in ids])
    legs = legs.reshape(len(ids), len(ids))  # (F, F)
    back_and_on = first_leg[:, None] + first_leg  # where there is no direct way: by the start
    opening = np.array([place.open_cost or 0.0 for place in places])  # (F,)
    legs = np.where(np.isfinite(legs), legs, back_and_on) + look_cost
    legs += opening * ~np.eye(len(ids), dtype=bool)
    first_leg = first_leg + look_cost + opening * (np.array(ids, dtype=object) != opened)
    rounds = 1 if miss_again is None else MOST_ROUNDS
    turn, at = (part.ravel() for part in np.indices((rounds, len(ids))))  # (K,), K looks
    prob = np.array([place.probability * place.detection for place in places])[at]
    prob *= np.power(0.0 if miss_again is None else miss_again, turn)
    first_leg, legs = first_leg[at], legs[np.ix_(at, at)]
    orders = [_order_greedily(prob, first_leg, legs, [])]
    # Who may look again and again gives up some time: the cost is that of finding it.
    weight = prob if miss_again is None else prob / max(float(prob.sum()), 1e-300)
    if distance is not None and ids:
        promise = prob / np.maximum(first_leg, 1e-9)
        few = np.argsort(-promise, kind="stable")[:EXACT_PLACES]
        (tour,) = plan_tour(
            weight[None, few], first_leg[None, few], legs[np.ix_(few, few)][None],
            np.ones((1, len(few)), dtype=bool),
        )  # fmt: skip
        orders.append(_order_greedily(prob, first_leg, legs, few[tour].tolist()))
    order = min(
        orders,
        key=lambda order: np.multiply(*compute_tour_costs(weight, first_leg, legs, order)).sum(),
    )
    cost, prob_needed = compute_tour_costs(prob, first_leg, legs, order)
    before = [opened, *(ids[place] for place in at[order])]
    looks = [
        Look(
            places[place], float(leg), float(needed),
            places[place].open_cost is not None and ids[place] != last,
        )
        for place, leg, needed, last in zip(at[order], cost, prob_needed, before, strict=False)
    ]  # fmt: skip
    return SearchPlan(description, tuple(looks), float(cost @ prob_needed), float(prob.sum()))


def find_distance(
    memory: SceneGraphMemory, start: Any, distance: Distance | None = None
) -> Distance | None:
    """Return a given function of distances, else the straight line in metres.

    The latter is for a start and furniture that all have positions; None for others. The start is
    (x, y) in metres, or a furniture id; None for no start. There is no way to what has no position:
    furniture that was added later without one.

    Raises:
        TypeError: if the distance is no function.
        ValueError: if the start is neither, beside positions of all furniture.
    """
    if callable(distance):
        return distance
    if distance is not None:
        raise TypeError(
            f"distance must be a function of (start or furniture id, furniture id), got "
            f"{shorten(distance)}. Leave it out where all furniture has a position."
        )
    at = memory.layout.compute_positions()
    if start is None or None in at.values():
        return None
    try:
        if not (isinstance(start, (int, np.integer)) and start in at):
            read_position(start)
    except ValueError:
        raise ValueError(
            f"start must be (x, y) in metres or a furniture id where all furniture has a position, "
            f"got {shorten(start)}. Give distance= to start from a place with a name."
        ) from None

    def measure(origin: Any, furniture: int) -> float:
        if furniture not in at:  # added since
            at.update(memory.layout.compute_positions())
        is_id = isinstance(origin, (int, np.integer))
        here: Any = at.get(origin) if is_id else origin
        there = at.get(furniture)
        return math.inf if here is None or there is None else math.dist(here, there)

    return measure


def is_at(start: Any, furniture: int) -> bool:
    """Tell whether a start, as `Distance` understands it, is that furniture node."""
    return isinstance(start, (int, np.integer)) and int(start) == furniture


def _order_greedily(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, begin: list[int]
) -> np.ndarray:
    """Go on with the best probability per cost of the next leg, (K,) looks in order."""
    order = list(begin)
    is_left = np.ones(len(prob), dtype=bool)
    is_left[begin] = False
    while len(order) < len(prob):
        cost = legs[order[-1]] if order else first_leg
        promise = np.where(is_left, prob / np.maximum(cost, 1e-9), -1.0)
        order.append(int(promise.argmax()))
        is_left[order[-1]] = False
    return np.array(order, dtype=np.int64)


def compute_way(distance: Distance | None, start: Any, to: int) -> float:
    """Return the cost of a way; 0 without distances, and for none.

    Raises:
        ValueError: if the distance is no number, 0 or more.
    """
    if distance is None or is_at(start, to):
        return 0.0
    cost = distance(start, to)
    if not is_number(cost) or not cost >= 0:  # nan, too
        raise ValueError(
            f"distance from {shorten(start)} to {to} must be a number, 0 or more, got "
            f"{shorten(cost)}. Where there is no way, give math.inf."
        )
    return float(cost)


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
    """Return the cost of each leg of a tour, and the probability that it has to be gone, (k,) each.

    Their product summed up is the expected cost. `order` has the places of the tour, (k,); the rest
    is as in `plan_tour`, for one tour.
    """
    cost = np.append(first_leg[order[:1]], legs[order[:-1], order[1:]])
    found = np.cumsum(prob[order])
    return cost, np.maximum(1 - found + prob[order], 0)

"""In which order to look for something, given where it may be and how far that is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sgm.checks import MOST_COST, is_number
from sgm.finder.evidence import tell_point
from sgm.finder.ranking import Place
from sgm.finder.tour_optimiser import (
    compute_expected_cost,
    compute_prob_needed,
    improve_begin,
    order_greedily,
    plan_tour,
)
from sgm.finder.travel_costs import Distance, TravelCosts, check_start
from sgm.layout.box import Box
from sgm.layout.layout import Layout
from sgm.memory.sighting import Point
from sgm.messages import shorten
from sgm.names.asking import make_asking
from sgm.names.sections import ENGLISH
from sgm.schema import RELATION_TABLE, USUAL_RELATION

MOST_ROUNDS = 3  # looks at one place: a detector that misses a quarter misses 2 % thrice
EXACT_PLACES = 12  # looks planned exactly: 12 ms; each further one takes twice as long
MOST_PLANNED = 96  # looks planned together: three at each of 32 places
LITTLE = 1e-3  # share of what looks can find that a plan of more than MOST_PLANNED leaves out

_EXACT_BEGIN = 9  # first looks planned exactly where there are more than EXACT_PLACES
_MOST_STARTS = 6  # first looks that are tried
_MOST_STOPS = 8  # likely places near which a way leads


@dataclass(frozen=True, slots=True)
class Look:
    """One look of a plan.

    Attributes:
        place: where, with the probability that the object is there, and that a look shows it.
        cost: of going there from the place before, opening it, if it has to be, and looking.
        prob_needed: probability that the object was not found before.
        must_open: whether it has to be opened to look into it; not for another look at a place
            where one stands.
        layout: rooms and furniture, that give positions; None where there are none.
    """

    place: Place
    cost: float
    prob_needed: float
    must_open: bool = False
    layout: Layout | None = field(default=None, repr=False, compare=False)

    @property
    def position(self) -> Point | None:
        """Where to look, x, y, z in the map, metres: where the thing was seen, else the place."""
        if self.place.position is not None or self.layout is None:
            return self.place.position
        return self.layout.furniture[self.place.furniture].location

    @property
    def pose(self) -> tuple[float, float, float] | None:
        """Where to stand, x, y in the map, metres, and yaw, radians; None where that is unknown."""
        if self.layout is None:
            return None
        return self.layout.compute_pose(self.place.furniture, self.place.position)

    @property
    def box(self) -> Box | None:
        """Extents of the place; None where they are unknown."""
        return None if self.layout is None else self.layout.furniture[self.place.furniture].box

    @property
    def instruction(self) -> str:
        """What to do there: "open the white fridge in kitchen", "look on the table in hall".

        And where, if the thing was seen there: "look on the table in hall, at 1.9, 3.1, 0.75".
        """
        asking = make_asking(self.place.evidence.language)
        name = asking.translate(self.place.name)
        if self.must_open:
            return asking.say("open", place=name)
        is_told = self.place.relation in RELATION_TABLE  # not where the place was asked for
        relation = self.place.relation if is_told else USUAL_RELATION
        look = asking.say_look(relation, name)
        if self.place.position is None:
            return look
        return asking.say("look toward", look=look, point=tell_point(self.place.position))


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
        asking = make_asking(self.looks[0].place.evidence.language if self.looks else ENGLISH)
        chance, cost = f"{self.found:.0%}", f"{self.expected_cost:.1f}"
        lines = [asking.say("plan", thing=self.description, percent=chance, cost=cost)]
        for number, look in enumerate(self.looks, start=1):
            name = asking.translate(look.place.name)
            name = asking.say("open", place=name) if look.must_open else name
            chance, cost = f"{look.place.probability:.0%}", f"{look.cost:.1f}"
            told = asking.say("plan look", place=name, percent=chance, cost=cost)
            lines.append(f"{number:3}. {told}")
        return "\n".join(lines)


def plan_search(
    description: str,
    places: Sequence[Place],
    start: Any = None,
    distance: Distance | TravelCosts | None = None,
    look_cost: float = 1.0,
    miss_again: float | None = None,
    opened: int | None = None,
    most: int | None = None,
    layout: Layout | None = None,
) -> SearchPlan:
    """Order looks so that the expected cost until the object is found is small.

    The k-th look at a place is the first that finds the object with probability p d a^(k - 1). It
    is there with p, and a look shows it with d (`Place.detection`). Each look that misses it leaves
    the share a (`Detector.miss_again`) of what the next one can find.

    Up to `EXACT_PLACES` looks are in the order that costs least, and so are all of them without
    distances. For more, some orders are made, and the cheapest one is taken: the best gain per cost
    of the next leg first, from each promising first look on; and the optimum over the most
    promising looks, followed by the others in the first manner. The first looks of each are then
    improved (`improve_begin`). For 14 places that costs .1 % more than the least on average, and
    less than 1 % more in 49 of 50 cases (`tests/sgm/finder/test_tour_costs.py`).

    Of more than `MOST_PLANNED` looks, that many are planned so: those with the best gain per cost
    of the way from here, or from one of the likeliest places. The others follow, the best gain per
    cost of the next leg first. The least likely places are then left out, as long as looks at all
    of them would find no more than the share `LITTLE`. `distance` is asked for ways between looks
    that are planned together.

    What must be opened (`Place.open_cost`) is shut again when one leaves: it costs to be opened
    with every way that leads to it, and not for another look on the spot.

    Args:
        description: what is looked for.
        places: where it may be, with probabilities that sum to at most one.
        start: where the search starts, as `distance` understands it.
        distance: cost of the way, `distance(start, furniture)` and `distance(furniture, furniture)`
            with furniture ids; infinite where there is no way: such places are left out; None if
            only looks cost. It is not asked for the way from a place to itself, which is none.
            `TravelCosts` to keep what it says for further plans.
        look_cost: of one look, in the unit of the distances.
        miss_again: a above; each place is then looked at `MOST_ROUNDS` times, in the order that
            costs least where one of these looks finds it. None for one look each.
        opened: furniture id of what is open now; None for none.
        most: looks to plan, the first ones of all; None for all.
        layout: rooms and furniture, by which looks tell positions; None for none.

    Raises:
        ValueError: if a cost is negative or nan, or there is a start without distances.

    Source: Kadane (1968), "Discrete search and the Neyman-Pearson lemma": without ways between the
    places, the best gain per cost first is the optimum, since gains of a place fall.
    """
    check_start(start, distance)
    check_look_cost(look_cost)
    ways = distance if isinstance(distance, TravelCosts) else TravelCosts(distance)
    rounds = 1 if miss_again is None else MOST_ROUNDS
    legs = _Legs(_choose_places(places, start, ways, rounds), start, ways, look_cost, opened)
    places = legs.places
    turn, stop = (part.ravel() for part in np.indices((rounds, len(places))))  # (K,), K looks
    prob = np.array([place.probability * place.detection for place in places])[stop]
    prob *= np.power(0.0 if miss_again is None else miss_again, turn)
    # Who may look again and again gives up some time: the cost is that of finding it.
    weight = prob if miss_again is None else prob / max(float(prob.sum()), 1e-300)
    order = _order_looks(legs, stop, prob, weight, most)
    cost, chance = legs.compute_costs(stop[order]), prob[order]
    prob_needed = compute_prob_needed(chance)
    before = [opened, *(places[place].furniture for place in stop[order])]
    looks = [
        Look(
            places[place],
            float(leg),
            float(needed),
            places[place].open_cost is not None and places[place].furniture != last,
            layout,
        )
        for place, leg, needed, last in zip(stop[order], cost, prob_needed, before, strict=False)
    ]
    return SearchPlan(description, tuple(looks), float(cost @ prob_needed), float(chance.sum()))


def check_look_cost(look_cost: object) -> None:
    """Raise ValueError unless the cost of a look is a number, 0 to `MOST_COST`."""
    if not is_number(look_cost) or not 0 <= look_cost <= MOST_COST:
        raise ValueError(
            f"look_cost must be a number, 0 to {MOST_COST:g}, got {shorten(look_cost)}. Give the "
            "cost of a look in the unit of the distances."
        )


def _choose_places(
    places: Sequence[Place], start: Any, ways: TravelCosts, rounds: int
) -> list[tuple[Place, float]]:
    """Return the places that matter and can be reached, with the ways there, as they were given."""
    least = MOST_PLANNED // rounds
    gain = np.array([place.probability * place.detection for place in places])
    left, held = float(gain.sum()), 0.0
    chosen: dict[int, float] = {}
    for number in np.argsort(-gain, kind="stable").tolist():
        if len(chosen) >= least and held >= (1 - LITTLE) * left:
            break
        way = ways.compute(start, places[number].furniture)
        if np.isfinite(way):
            chosen[number] = way
            held += gain[number]
        else:
            left -= gain[number]
    return [(places[number], chosen[number]) for number in sorted(chosen)]


class _Legs:
    """What it costs to go to each of F places and look, from here and from one another.

    Attributes:
        places: F.
        first: of the first leg, (F,).
        has_ways: whether ways cost anything, or only looks do.
    """

    def __init__(
        self,
        places: Sequence[tuple[Place, float]],
        start: Any,
        ways: TravelCosts,
        look_cost: float,
        opened: int | None,
    ) -> None:
        """Take the places with the ways there from the start."""
        self.places = [place for place, _ in places]
        self._ids = [place.furniture for place in self.places]
        self._from_start = np.array([way for _, way in places])
        self._ways, self._look_cost = ways, look_cost
        self._opening = np.array([place.open_cost or 0.0 for place in self.places])
        self.has_ways = ways.distance is not None
        is_shut = np.array(self._ids, dtype=object) != opened
        self.first = self._from_start + look_cost + self._opening * is_shut

    def compute_row(self, origin: int, to: np.ndarray) -> np.ndarray:
        """Return the costs from one place to n others, or to look again, (n,)."""
        way = self._ways.compute_row(self._ids[origin], [self._ids[place] for place in to.tolist()])
        # Where there is no direct way: by the start.
        way = np.where(np.isfinite(way), way, self._from_start[origin] + self._from_start[to])
        cost: np.ndarray = way + self._look_cost + self._opening[to] * (to != origin)
        return cost

    def compute_all(self, places: np.ndarray) -> np.ndarray:
        """Return the costs between n looks at places, (n,) -> (n, n)."""
        origins, origin_of = np.unique(places, return_inverse=True)
        legs = np.array([self.compute_row(place, origins) for place in origins.tolist()])
        return legs.reshape(len(origins), len(origins))[np.ix_(origin_of, origin_of)]

    def compute_costs(self, order: np.ndarray) -> np.ndarray:
        """Return the cost of each leg of looks at places in order, (n,) -> (n,)."""
        pairs = zip(order[:-1].tolist(), order[1:], strict=True)
        further = [self.compute_row(origin, np.array([to])) for origin, to in pairs]
        return np.concatenate([self.first[order[:1]], *further])


def _order_looks(
    legs: _Legs, place: np.ndarray, prob: np.ndarray, weight: np.ndarray, most: int | None
) -> np.ndarray:
    """Order looks at places (K,), which find it first with `prob`; the first ones, (n,)."""
    left = np.arange(len(place))
    order = np.zeros(0, dtype=np.int64)
    while len(left) and (most is None or len(order) < most):
        if len(order):
            last = int(place[order[-1]])
            left_places, place_of = np.unique(place[left], return_inverse=True)
            first = legs.compute_row(last, left_places)[place_of]
        else:
            first = legs.first[place[left]]
        together = np.arange(len(left))
        if len(left) > MOST_PLANNED:
            nearest = first if len(order) else _find_nearest(legs, place, prob, first)
            promise = prob[left] / np.maximum(nearest, 1e-9)
            together = np.sort(np.argsort(-promise, kind="stable")[:MOST_PLANNED])
        next_ones = left[together]
        between = legs.compute_all(place[next_ones])
        part = prob[next_ones], weight[next_ones], first[together], between
        if len(order) or not legs.has_ways:
            found = order_greedily(part[0], part[2], part[3])
        else:
            found = _order_well(*part)
        order = np.append(order, next_ones[found])
        left = np.delete(left, together)
    return order[:most]


def _find_nearest(
    legs: _Legs, place: np.ndarray, prob: np.ndarray, first: np.ndarray
) -> np.ndarray:
    """Return what each of K looks costs from here or from the likely stop that is nearest, (K,)."""
    if not legs.has_ways:
        return first
    targets, target_of = np.unique(place, return_inverse=True)
    likely = np.argsort(-prob / np.maximum(first, 1e-9), kind="stable")
    stops = list(dict.fromkeys(place[likely].tolist()))[:_MOST_STOPS]
    costs = [legs.compute_row(stop, targets)[target_of] for stop in stops]
    nearest: np.ndarray = np.minimum.reduce([first, *costs])
    return nearest


def _order_well(
    prob: np.ndarray, weight: np.ndarray, first_leg: np.ndarray, legs: np.ndarray
) -> np.ndarray:
    """Return the cheapest order of K looks of those that `plan_search` makes, (K,)."""
    promise = prob / np.maximum(first_leg, 1e-9)
    likely = np.argsort(-promise, kind="stable")
    few = likely if len(likely) <= EXACT_PLACES else likely[:_EXACT_BEGIN]
    (tour,) = plan_tour(
        weight[None, few],
        first_leg[None, few],
        legs[np.ix_(few, few)][None],
        np.ones((1, len(few)), dtype=bool),
    )
    orders = [
        order_greedily(prob, first_leg, legs),
        order_greedily(prob, first_leg, legs, few[tour].tolist()),
    ]
    if len(few) < len(prob):
        starts = likely[1:_MOST_STARTS].tolist()
        orders += [order_greedily(prob, first_leg, legs, [look]) for look in starts]
        orders += [improve_begin(weight, first_leg, legs, order) for order in orders]
    cost = compute_expected_cost(weight, first_leg, legs, np.array(orders))
    return orders[int(cost.argmin())]

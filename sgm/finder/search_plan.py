"""In which order to look for something, given where it may be and how far that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.checks import is_number
from sgm.finder.ranking import Place
from sgm.finder.tour import compute_tour_costs, plan_tour
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten

# (from, to) -> cost of the way; `from` is the start or a furniture id, `to` a furniture id.
Distance = Callable[[Any, int], float]

EXACT_PLACES = 9  # planned exactly: 10 ms; each further place takes twice as long


@dataclass(frozen=True, slots=True)
class Look:
    """One look of a plan.

    Attributes:
        place: where, with the probability that the object is there.
        cost: of going there from the place before and looking.
        prob_needed: probability that the object was not found before.
    """

    place: Place
    cost: float
    prob_needed: float


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
            lines.append(
                f"{number:3}. {look.place.name}, {look.place.probability:.0%}, cost {look.cost:.1f}"
            )
        return "\n".join(lines)


def plan_search(
    description: str,
    places: Sequence[Place],
    start: Any = None,
    distance: Distance | None = None,
    look_cost: float = 1.0,
) -> SearchPlan:
    """Order places so that the expected cost until the object is found is small.

    Two orders are made, and the cheaper one is taken: the best probability per cost of the next leg
    first; and the exact optimum over the `EXACT_PLACES` most promising places, followed by the
    others in the first manner. With so few places or fewer, and without distances, it is the
    optimum.

    Args:
        description: what is looked for.
        places: where it may be, with probabilities that sum to at most one.
        start: where the search starts, as `distance` understands it.
        distance: cost of the way, `distance(start, furniture)` and `distance(furniture, furniture)`
            with furniture ids; infinite where there is no way: such places are left out; None if
            only looks cost.
        look_cost: of one look, in the unit of the distances.

    Raises:
        ValueError: if a cost is negative or nan, or there is a start without distances.
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
    first_leg = np.array([_measure(distance, start, place.furniture) for place in places])  # (K,)
    is_near = np.isfinite(first_leg)
    places = [place for place, near in zip(places, is_near, strict=True) if near]
    first_leg = first_leg[is_near]
    ids = [place.furniture for place in places]
    legs = np.array([[_measure(distance, at, to) for to in ids] for at in ids])
    legs = legs.reshape(len(ids), len(ids))  # (K, K)
    back_and_on = first_leg[:, None] + first_leg  # where there is no direct way: by the start
    legs = np.where(np.isfinite(legs), legs, back_and_on) + look_cost
    first_leg = first_leg + look_cost
    prob = np.array([place.probability for place in places])
    orders = [_order_greedily(prob, first_leg, legs, [])]
    if distance is not None and ids:
        promise = prob / np.maximum(first_leg, 1e-9)
        few = np.argsort(-promise, kind="stable")[:EXACT_PLACES]
        (tour,) = plan_tour(
            prob[None, few], first_leg[None, few], legs[np.ix_(few, few)][None],
            np.ones((1, len(few)), dtype=bool),
        )  # fmt: skip
        orders.append(_order_greedily(prob, first_leg, legs, few[tour].tolist()))
    tours = [(order, *compute_tour_costs(prob, first_leg, legs, order)) for order in orders]
    order, cost, prob_needed = min(tours, key=lambda tour: tour[1] @ tour[2])
    looks = [
        Look(places[place], float(leg), float(needed))
        for place, leg, needed in zip(order, cost, prob_needed, strict=True)
    ]
    return SearchPlan(description, tuple(looks), float(cost @ prob_needed), float(prob.sum()))


def find_distance(memory: SceneGraphMemory, start: Any) -> Distance | None:
    """Return the straight line in metres, if the start and all furniture have positions.

    There is no way to what has no position: furniture that was added later without one.

    Args:
        memory: with the positions of its furniture.
        start: (x, y) in metres, or a furniture id; None for no start.
    """
    at = {number: node.position for number, node in memory.layout.furniture.items()}
    if start is None or None in at.values():
        return None

    def measure(origin: Any, furniture: int) -> float:
        if furniture not in at:  # added since
            at.update((number, node.position) for number, node in memory.layout.furniture.items())
        here: Any = at.get(origin, origin) if isinstance(origin, int) else origin
        there = at.get(furniture)
        return math.inf if here is None or there is None else math.dist(here, there)

    return measure


def _order_greedily(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, begin: list[int]
) -> np.ndarray:
    """Go on with the best probability per cost of the next leg, (K,) places in order."""
    order = list(begin)
    rest = [place for place in range(len(prob)) if place not in begin]
    while rest:
        cost = legs[order[-1]] if order else first_leg
        best = max(rest, key=lambda place: prob[place] / max(cost[place], 1e-9))
        order.append(best)
        rest.remove(best)
    return np.array(order, dtype=np.int64)


def _measure(distance: Distance | None, start: Any, to: int) -> float:
    if distance is None:
        return 0.0
    cost = distance(start, to)
    if not is_number(cost) or not cost >= 0:  # nan, too
        raise ValueError(
            f"distance from {shorten(start)} to {to} must be a number, 0 or more, got "
            f"{shorten(cost)}. Where there is no way, give math.inf."
        )
    return float(cost)

"""How two prior graphs differ: rank correlations, missing types, largest differences."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from sgm.prior.prior_graph import PriorGraph
from tools.priors.counts import PlaceKey


@dataclass(frozen=True, slots=True)
class PriorComparison:
    """Differences between two prior graphs A and B.

    Attributes:
        furniture_correlation: Spearman's rho of the furniture probabilities of a room.
        placement_correlation: Spearman's rho of P(furniture, relation | object, room).
        num_furniture: pairs in the first correlation.
        num_placements: pairs in the second.
        only_a: what A alone has: "rooms", "furniture", "objects", "places" -> names.
        only_b: what B alone has.
        furniture_differences: (B - A, name), largest first.
        placement_differences: (B - A, name), largest first.
    """

    furniture_correlation: float
    placement_correlation: float
    num_furniture: int
    num_placements: int
    only_a: dict[str, list[str]]
    only_b: dict[str, list[str]]
    furniture_differences: list[tuple[float, str]]
    placement_differences: list[tuple[float, str]]


def compare_priors(a: PriorGraph, b: PriorGraph) -> PriorComparison:
    """Compare two prior graphs.

    Both correlations are over what either graph has, a missing entry counting as 0; placements only
    of objects that both know in the room, since P(. | object, room) has no meaning elsewhere.
    """
    furniture_a, furniture_b = _find_furniture_probs(a), _find_furniture_probs(b)
    places_a, places_b = _find_place_probs(a), _find_place_probs(b)
    furniture = sorted(furniture_a.keys() | furniture_b.keys())
    shared = {(key[0], key[2]) for key in places_a} & {(key[0], key[2]) for key in places_b}
    places = sorted(
        (key for key in places_a.keys() | places_b.keys() if (key[0], key[2]) in shared),
        key=lambda key: tuple(map(str, key)),
    )
    parts_a, parts_b = _find_parts(a, places_a), _find_parts(b, places_b)
    return PriorComparison(
        furniture_correlation=compute_rank_correlation(
            np.array([furniture_a.get(key, 0.0) for key in furniture]),
            np.array([furniture_b.get(key, 0.0) for key in furniture]),
        ),
        placement_correlation=compute_rank_correlation(
            np.array([places_a.get(key, 0.0) for key in places]),
            np.array([places_b.get(key, 0.0) for key in places]),
        ),
        num_furniture=len(furniture),
        num_placements=len(places),
        only_a={part: sorted(parts_a[part] - parts_b[part]) for part in parts_a},
        only_b={part: sorted(parts_b[part] - parts_a[part]) for part in parts_b},
        furniture_differences=_rank(
            {
                f"{label} in {room}": furniture_b.get((room, label), 0.0)
                - furniture_a.get((room, label), 0.0)
                for room, label in furniture
            }
        ),
        placement_differences=_rank(
            {_name(key): places_b.get(key, 0.0) - places_a.get(key, 0.0) for key in places}
        ),
    )


def compute_rank_correlation(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Spearman's rho with ties averaged; nan if either side is constant or shorter than two."""
    if len(x) < 2 or np.ptp(x) == 0 or np.ptp(y) == 0:
        return float("nan")
    return float(spearmanr(x, y).statistic)


def _find_furniture_probs(prior: PriorGraph) -> dict[tuple[str, str], float]:
    return {
        (furniture_type.room, furniture_type.label): furniture_type.prob
        for furniture_type in prior.furniture
    }


def _find_place_probs(prior: PriorGraph) -> dict[PlaceKey, float]:
    """P(furniture, relation | object, room), whatever the scale of the file."""
    totals: dict[tuple[str | None, str], float] = defaultdict(float)
    for placement in prior.placements:
        totals[placement.room, placement.object] += placement.prob
    return {
        (placement.room, placement.furniture, placement.object, placement.relation): placement.prob
        / totals[placement.room, placement.object]
        for placement in prior.placements
        if placement.prob > 0
    }


def _find_parts(prior: PriorGraph, places: dict[PlaceKey, float]) -> dict[str, set[str]]:
    return {
        "rooms": set(prior.rooms),
        "furniture": {
            f"{furniture_type.label} in {furniture_type.room}" for furniture_type in prior.furniture
        },
        "objects": {object_type.label for object_type in prior.objects},
        "places": {_name(key) for key in places},
    }


def _name(key: PlaceKey) -> str:
    room, furniture, label, relation = key
    return f"{label} {relation} {furniture}{f' in {room}' if room else ''}"


def _rank(differences: dict[str, float]) -> list[tuple[float, str]]:
    return sorted(
        ((value, name) for name, value in differences.items() if value),
        key=lambda pair: (-abs(pair[0]), pair[1]),
    )

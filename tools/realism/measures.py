"""What is measured of a home that was looked at every hour."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.world.homes import Homes

OUT = -1  # the place of an object that is out of the home and comes back
NOT_THERE = -2  # before an object is in the home for the first time, and after the last

# What is reported of a home, by attribute of `Behaviour`.
MEASURES: Mapping[str, str] = {
    "changes_per_hour": "objects that change place, per hour",
    "changes_per_waking_hour": "the same from 7:00 to 24:00",
    "moves_per_day": "changes of place per object and day",
    "ever_moves": "objects that ever move",
    "places": "places that an object is seen at",
    "entropy": "entropy of an object's places, bits",
    "at_usual": "snapshots at the object's most frequent place",
    "at_usual_by_hour": "the same, knowing the hour of the day",
    "median_absence": "length of an absence from it, median, hours",
    "long_absence": "the same, 90 % are shorter, hours",
    "with_company": "changes in the same hour as another one",
    "same_way": "changes from and to the same places as another one in that hour",
}


@dataclass(frozen=True, slots=True)
class Behaviour:
    """What was measured of one home; see `MEASURES`."""

    changes_per_hour: float
    changes_per_waking_hour: float
    moves_per_day: float
    ever_moves: float
    places: float
    entropy: float
    at_usual: float
    at_usual_by_hour: float
    median_absence: float
    long_absence: float
    with_company: float
    same_way: float


def follow_homes(homes: Homes, num_steps: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Let homes live and note the furniture at which every object is, home by home.

    An object is known by its slot and description: one that leaves and comes back is the same.

    Returns:
        For every home the furniture index of its objects, `OUT` between two stays, `NOT_THERE`
        otherwise, (N, T + 1), and their types, (N,).
    """
    furniture, codes = [homes.object_furniture.copy()], [homes.object_code.copy()]
    for _ in range(num_steps):
        homes.evolve()
        furniture.append(homes.object_furniture.copy())
        codes.append(homes.object_code.copy())
    whereabouts, code = np.stack(furniture, axis=2), np.stack(codes, axis=2)  # (H, C, T + 1)
    type_of_code = homes.object_descriptions.type_of_code
    return [_list_objects(*home, type_of_code) for home in zip(whereabouts, code, strict=True)]


def measure_behaviour(whereabouts: np.ndarray, hour: np.ndarray) -> Behaviour:
    """Measure one home.

    Args:
        whereabouts: furniture index of every object at every hour, `OUT` or `NOT_THERE`,
            (N, T + 1).
        hour: hour of the day of each of them, (T + 1,).

    Raises:
        ValueError: if there is no object, or fewer than two hours.
    """
    if len(whereabouts) == 0 or whereabouts.shape[1] < 2:
        raise ValueError(
            f"home must hold objects for at least two hours, got {len(whereabouts)} objects and "
            f"{whereabouts.shape[1]} hours. Look at it for longer."
        )
    is_there = whereabouts != NOT_THERE
    has_changed = (whereabouts[:, 1:] != whereabouts[:, :-1]) & is_there[:, 1:] & is_there[:, :-1]
    num_steps = (is_there[:, 1:] & is_there[:, :-1]).sum()
    is_waking = hour[1:] >= 7
    entropies, places, usual, by_hour, absences = [], [], 0, 0, []
    for path in whereabouts:
        present = path[path != NOT_THERE]
        share = np.unique(present, return_counts=True)[1] / len(present)
        entropies.append(-(share * np.log2(share)).sum())
        places.append(len(share))
        most = find_mode(present)
        usual += (present == most).sum()
        hours = hour[path != NOT_THERE]
        by_hour += sum(_count_mode(present[hours == h]) for h in np.unique(hours))
        absences += _measure_runs(present != most)
    company, same_way = _count_company(whereabouts, has_changed)
    num_changes = max(int(has_changed.sum()), 1)
    return Behaviour(
        changes_per_hour=has_changed.sum() / num_steps,
        changes_per_waking_hour=float(has_changed[:, is_waking].sum())
        / max(float((is_there[:, 1:] & is_there[:, :-1])[:, is_waking].sum()), 1.0),
        moves_per_day=24 * has_changed.sum() / num_steps,
        ever_moves=float(has_changed.any(axis=1).mean()),
        places=float(np.mean(places)),
        entropy=float(np.mean(entropies)),
        at_usual=usual / is_there.sum(),
        at_usual_by_hour=by_hour / is_there.sum(),
        median_absence=float(np.median(absences)) if absences else 0.0,
        long_absence=float(np.quantile(absences, 0.9)) if absences else 0.0,
        with_company=company / num_changes,
        same_way=same_way / num_changes,
    )


def _list_objects(
    whereabouts: np.ndarray, code: np.ndarray, type_of_code: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """List the objects of a home, a row each, and their types; of slots (C, T + 1) each."""
    rows, types = [], []
    for places, codes in zip(whereabouts, code, strict=True):
        for each_code in np.unique(codes[places >= 0]):
            is_here = np.flatnonzero((codes == each_code) & (places >= 0))
            path = np.full(len(places), NOT_THERE)
            path[is_here[0] : is_here[-1] + 1] = OUT
            path[is_here] = places[is_here]
            rows.append(path)
            types.append(type_of_code[each_code])
    return np.array(rows), np.array(types)


def find_mode(values: np.ndarray) -> int:
    """Return the most frequent of values, of equals the least."""
    found, count = np.unique(values, return_counts=True)
    return int(found[count.argmax()])


def _count_mode(values: np.ndarray) -> int:
    return int(np.unique(values, return_counts=True)[1].max())


def _measure_runs(is_on: np.ndarray) -> list[int]:
    """Return the lengths of the runs of true values."""
    edges = np.diff(np.concatenate([[0], is_on.astype(np.int8), [0]]))
    return (np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)).tolist()


def _count_company(whereabouts: np.ndarray, has_changed: np.ndarray) -> tuple[int, int]:
    """Count changes that come with another one in the step, and with one the same way."""
    company = same_way = 0
    for step in np.flatnonzero(has_changed.any(axis=0)):
        ways: dict[tuple[int, int], int] = defaultdict(int)
        for thing in np.flatnonzero(has_changed[:, step]):
            ways[int(whereabouts[thing, step]), int(whereabouts[thing, step + 1])] += 1
        total = sum(ways.values())
        company += total if total > 1 else 0
        same_way += sum(count for count in ways.values() if count > 1)
    return company, same_way

"""How one home with abstract dynamics is lived in: where its things are kept and used, and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MOST_ACTIVITIES = 24
MOST_STAGES = 3  # places that an activity leads its things through

# What differs between homes is drawn evenly between these bounds, unless it says otherwise.
_POPULARITY = (-1.5, 1.0)  # logarithm of the concentration of usual places on few furniture nodes
_KEPT_BY_NAME = 0.7  # share of the homes in which things of a name are kept together
_STRAYS = (0.0, 0.3)  # share of the things that are kept anywhere all the same
_SECOND_PLACES = (0.0, 0.3)  # share of the things with a second usual place
_USED = (0.3, 1.0)  # share of the things that are used
_BY_FREQUENCY = (0.0, 0.5, 1.0)  # power of `move_freq` in who of them it is, one of these
_FONDNESS = (1.0, 6.0)  # logarithm of how much an activity prefers things that are kept together
_MOST_THINGS = 10  # of an activity
_NUM_STAGES = (0.5, 0.35, 0.15)  # share of the activities with one, two and three places
_HUB = 0.5  # concentration of places of activities
_HOURS_AT_PLACE = (0.5, 5.0)  # typical duration, varied by a factor e^.5 (standard deviation)
_EARLIEST, _LATEST = 6.0, 24.0  # hour of an activity
_SPREADS, _SPREAD_SHARES = (0.3, 1, 3, 12), (0.3, 0.3, 0.2, 0.2)  # hours about it
_FORGOTTEN = (0.0, 0.15)  # share of the things that stay where they were used
_SETTLING_SHARE = 0.3  # share of the homes in which usual places change
_SETTLES = (-9.0, -5.0)  # logarithm of how often one does, a step
_MOVES_PER_USE = 0.65  # moves that are seen, of those that activities make: places may be the same


@dataclass(frozen=True, slots=True)
class Ways:
    """What people do in one home of F furniture nodes and C objects, in A activities.

    Attributes:
        usual: usual place of each object, and its second one or the same again, (C, 2).
        route: furniture that an activity leads through, (A, 3).
        num_stages: how many of these, (A,).
        hours: how long things are at each, (A, 3).
        hour: of the day at which it takes place, (A,).
        spread: hours before and after it in which it may begin, (A,).
        chance: how often it takes place a day, (A,).
        use: how often it takes each object, (A, C).
        forgotten: share of the things that stay where they were used.
        settles: how often an object gets another usual place, a step.
        presence: share of what is known of each object beforehand that is about each furniture
            node, (C, F): between its share of the time and its share of the visits.
    """

    usual: np.ndarray
    route: np.ndarray
    num_stages: np.ndarray
    hours: np.ndarray
    hour: np.ndarray
    spread: np.ndarray
    chance: np.ndarray
    use: np.ndarray
    forgotten: float
    settles: float
    presence: np.ndarray


def draw_ways(
    rng: np.random.Generator,
    num_places: int,
    types: np.ndarray,
    move_freq: np.ndarray,
    step_hours: float,
    move_share: float,
) -> Ways:
    """Draw how a home is lived in.

    Args:
        rng: the home's own.
        num_places: furniture nodes, F.
        types: type of every object, (C,).
        move_freq: by type.
        step_hours: length of a step.
        move_share: share of the objects that move in a step, about.
    """
    usual = _draw_usual_places(rng, num_places, types, len(move_freq))
    count = int(rng.integers(MOST_STAGES, MOST_ACTIVITIES + 1))
    hub = _favour(rng, _HUB, num_places)
    route = rng.choice(num_places, (count, MOST_STAGES), p=hub)
    num_stages = rng.choice([1, 2, 3], size=count, p=_NUM_STAGES)
    typical = np.log(rng.uniform(*_HOURS_AT_PLACE, (count, 1)))
    hours = np.exp(rng.normal(typical, 0.5, (count, MOST_STAGES)))
    hour = rng.uniform(_EARLIEST, _LATEST, count)
    spread = np.maximum(rng.choice(_SPREADS, size=count, p=_SPREAD_SHARES), step_hours / 2)
    use = _draw_use(rng, usual[:, 0], move_freq[types], count)
    moves = (use.sum(axis=1) * (1 + num_stages)).sum() * step_hours / 24 / len(types)
    often = rng.uniform(0.3, 1, count) * move_share
    chance = np.minimum(often / max(moves * _MOVES_PER_USE, 1e-6), 1)
    settles = np.exp(rng.uniform(*_SETTLES)) * (rng.random() < _SETTLING_SHARE)
    presence = np.zeros((len(types), num_places))
    visits, exponent = chance[:, None] * use, rng.uniform(0.3, 1)
    for stage in range(MOST_STAGES):
        days = np.minimum(hours[:, stage] / 24, 1) ** exponent * (num_stages > stage)
        np.add.at(presence.T, route[:, stage], visits * days[:, None])
    rest = np.maximum(1 - presence.sum(axis=1), 0.2) / 2
    for column in usual.T:
        presence[np.arange(len(types)), column] += rest
    presence **= rng.uniform(0.5, 1)
    return Ways(
        usual, route, num_stages, hours, hour, spread, chance, use,
        float(rng.uniform(*_FORGOTTEN)), float(settles),
        presence / presence.sum(axis=1, keepdims=True),
    )  # fmt: skip


def _favour(rng: np.random.Generator, concentration: float, num_places: int) -> np.ndarray:
    """Draw how popular places are, (F,): of all popularities, the more alike the larger it is."""
    weights = rng.gamma(concentration, size=num_places) + 1e-6
    return weights / weights.sum()


def _draw_usual_places(
    rng: np.random.Generator, num_places: int, types: np.ndarray, num_types: int
) -> np.ndarray:
    """Draw the usual places of every object, (C, 2)."""
    count = len(types)
    popular = _favour(rng, float(np.exp(rng.uniform(*_POPULARITY))), num_places)
    by_name = rng.choice(num_places, num_types, p=popular)[types]
    each = rng.choice(num_places, count, p=popular)
    usual = by_name if rng.random() < _KEPT_BY_NAME else each
    strays = rng.random(count) < rng.uniform(*_STRAYS)
    usual = np.where(strays, rng.integers(num_places, size=count), usual)
    has_second = rng.random(count) < rng.uniform(*_SECOND_PLACES)
    second = np.where(has_second, rng.integers(num_places, size=count), usual)
    return np.stack([usual, second], axis=1)


def _draw_use(
    rng: np.random.Generator, usual: np.ndarray, move_freq: np.ndarray, count: int
) -> np.ndarray:
    """Draw how often activities take each object, (A, C): a first one, and others to go with it."""
    num = len(usual)
    frequent = (move_freq / max(move_freq.max(), 1e-9)) ** rng.choice(_BY_FREQUENCY)
    is_used = rng.random(num) < rng.uniform(*_USED) * frequent
    is_used[int(rng.integers(num))] = True
    size = rng.integers(1, 1 + min(_MOST_THINGS, num), size=count)
    first = rng.choice(num, count, p=is_used / is_used.sum())
    together = np.where(usual[first][:, None] == usual, rng.uniform(*_FONDNESS), 0)
    fit = np.where(is_used, together + rng.gumbel(size=(count, num)), -np.inf)
    fit[np.arange(count), first] = np.inf
    rank = np.argsort(np.argsort(-fit, axis=1), axis=1)
    is_taken = (rank < size[:, None]) & is_used
    return rng.uniform(0.4, 1, (count, 1)) * rng.uniform(0.3, 1, (count, num)) * is_taken

"""Things that keep hours: whether the hour of day tells where a thing is, and where that is."""

from __future__ import annotations

import numpy as np

from sgm.evidence.adaptive_filter import (
    TASKS_ASK_MOVED,
    FilterSettings,
    Rates,
    compare_hours,
    compute_beliefs,
    compute_destinations,
)
from sgm.evidence.expected import Expected
from sgm.evidence.object_counts import ObjectCounts
from sgm.memory.home_history import NUM_HOURS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

# Of things of which nothing is known, this many nats speak against keeping hours: 1 in 55 does.
_DOUBT = 4.0
_USUAL = 2.0  # sightings that an hour has anyway, at the thing's usual places
_ANYWHERE = 0.5  # sightings, spread over all places
_LEAST = 1e-3  # of a probability
# Where a thing goes by the hour, it soon does.
_BY_HOUR = FilterSettings(rate=0.7, crossing=1.0, asks_moved=TASKS_ASK_MOVED, hours=0.95)


def compute_keeping(hours: np.ndarray | None, num_places: np.ndarray) -> np.ndarray:
    """Return how likely each object keeps hours, (Q,); 0 without a clock.

    By Bayes' rule from its own sightings, each left out in turn: how likely is its place given
    those at about the same hour of day, and given all of them?

    Args:
        hours: sightings of Q objects by hour, (Q, F, NUM_HOURS); None without a clock.
        num_places: furniture nodes of their homes, (Q,).
    """
    if hours is None:
        return np.zeros(len(num_places))
    seen = hours.astype(float)
    at_place = seen.sum(axis=2, keepdims=True)
    total = at_place.sum(axis=1, keepdims=True)
    anywhere = _ANYWHERE / num_places[:, None, None]
    usual = (at_place - 1 + anywhere) / np.maximum(total - 1 + _ANYWHERE, _ANYWHERE)
    hour = np.arange(NUM_HOURS) * (24 / NUM_HOURS)
    near = seen @ compare_hours(hour[:, None] - hour)  # a sighting counts as one at its own hour
    at_hour = (near - 1 + _USUAL * usual) / np.maximum(
        near.sum(axis=1, keepdims=True) - 1 + _USUAL, _USUAL
    )
    gain = np.log(np.maximum(at_hour, _LEAST)) - np.log(np.maximum(usual, _LEAST))
    evidence = np.where(seen > 0, seen * gain, 0).sum(axis=(1, 2))
    return np.where(total[:, 0, 0] > 1, 1 / (1 + np.exp(_DOUBT - evidence.clip(-50, 50))), 0.0)


def follow_hours(
    memory: MemoryBatch, queries: Queries, counts: ObjectCounts, rates: Rates
) -> np.ndarray:
    """Return the belief of who goes by the hour of day, and by the latest looks.

    Returns:
        Probability of each place, (Q, F); the rest is elsewhere.
    """
    expected = Expected.by_prior(memory, queries)
    goes = compute_destinations(memory, queries, counts, expected, _BY_HOUR.hours)
    return compute_beliefs(memory, queries, rates, goes, [_BY_HOUR])[:, 0, :-1]

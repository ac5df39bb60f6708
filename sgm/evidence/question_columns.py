"""Columns of a question as a whole.

Each function computes the columns of a group of `sgm.evidence.columns`, by name, (Q,) each.
"""

from __future__ import annotations

import math

import numpy as np

from sgm.arrays.rows import add_in_order
from sgm.evidence.question import Question

_HOUR_ANGLE = 2 * math.pi / 24


def compute_size(asked: Question) -> dict[str, np.ndarray]:
    """How large the home is, and how much of it is known."""
    home, hours = asked.arrays.home, asked.arrays.hours
    num_known, sightings = asked.sums.num_known[home], asked.sums.sightings[home]
    return {
        "log_num_places": np.log(asked.arrays.num_places),
        "log_num_rooms": np.log(asked.counters.num_rooms),
        "num_known": np.log1p(num_known),
        "sightings_per_object": np.log1p(sightings / np.maximum(num_known, 1)),
        "age": np.log1p(asked.arrays.now * hours),
        "log_step": np.log(hours),
    }


def compute_movement(asked: Question) -> dict[str, np.ndarray]:
    """How fast things move here, and how much this one may have moved since it was seen."""
    rates, counters, hours = asked.rates, asked.counters, asked.counters.hours_since_seen
    was_seen = asked.arrays.num_seen > 0
    return {
        "log_home_rate": np.log(rates.home),
        "log_own_rate": np.log(rates.own),
        "own_moves": np.log1p(counters.num_moved),
        "hours_since_seen": np.log1p(hours),
        "home_moves_since_seen": np.where(was_seen, -np.expm1(-rates.home * hours), 1.0),
        "own_moves_since_seen": np.where(was_seen, -np.expm1(-rates.own * hours), 1.0),
        "any_moved": counters.any_moved,
        "crossing": rates.crossing,
        "moves": np.log1p(asked.sums.arrivals[asked.arrays.home].sum(axis=1)),
        "miss_rate": rates.miss,
    }


def compute_stays(asked: Question) -> dict[str, np.ndarray]:
    """How long things stay here, and this one; how often it was gone when asked for."""
    rates, counts, counters = asked.rates, asked.counts, asked.counters
    placed = _add_up(counts.num_true / np.maximum(counts.num_known, 1))
    return {
        "log_home_left_rate": np.log(rates.home_left),
        "log_left_rate": np.log(rates.left),
        "num_left_anywhere": np.log1p(counts.num_left.sum(axis=1)),
        "left_since_last_seen": -np.expm1(-rates.left * asked.counters.hours_since_seen),
        "unplaced": np.where(asked.arrays.num_seen > 0, np.maximum(1 - placed, 0.0), 1.0),
        "num_sought": np.log1p(counters.num_sought),
        "still_there": (counters.num_still + 0.5) / (counters.num_sought + 1),
    }


def compute_trust(asked: Question) -> dict[str, np.ndarray]:
    """How well simple rules and the prior have done in this home."""
    home, counters, sums = asked.arrays.home, asked.counters, asked.sums
    num_placed, num_found = sums.num_placed[home], counters.num_found
    return {
        "has_prior": asked.expected.trust > 0,
        "known_share": sums.num_typed[home] / np.maximum(sums.num_known[home], 1),
        "num_placed": np.log1p(num_placed),
        "prior_lift": sums.lift[home] / (num_placed + 3),
        "found": (num_found + 0.5) / (counters.num_asked + 1),
        "last_right": (counters.num_last_right + 0.5) / (num_found + 1),
        "common_right": (counters.num_common_right + 0.5) / (num_found + 1),
        "prior_right": (counters.num_prior_right + 0.5) / (num_found + 1),
    }


def compute_words(asked: Question) -> dict[str, np.ndarray]:
    """Whether the prior knows the thing, and how sure its name tells where it is kept."""
    return {
        "is_known": asked.expected.trust == 1,
        "name_cosine": asked.expected.name_cosine,
        "most_by_name": asked.expected.by_name.max(axis=1),
        "similar_known": np.log1p(_add_up(asked.companions.similar)),
        "most_similar": asked.companions.most_similar,
    }


def compute_object(asked: Question) -> dict[str, np.ndarray]:
    """Where the thing tends to be, how sure that is, and what filters say in sum."""
    arrays, counts, belief = asked.arrays, asked.counts, asked.ranking_belief
    was_seen, share = arrays.num_seen > 0, counts.num_true / np.maximum(arrays.num_seen, 1)[:, None]
    room_size = arrays.is_in_last_room.sum(axis=1)
    absent_at_last = counts.num_absent[np.arange(len(share)), np.maximum(arrays.last, 0)]
    return {
        "was_seen": was_seen,
        "num_seen": np.log1p(arrays.num_seen),
        "num_seen_places": np.log1p((counts.num_true > 0).sum(axis=1)),
        "entropy": -_add_up(share * np.log(share + 1e-9)),
        "most": share.max(axis=1),
        "most_prior": asked.expected.share.max(axis=1),
        "is_usual_last": was_seen & (counts.num_true.argmax(axis=1) == arrays.last),
        "absent_at_last": np.log1p(absent_at_last) * was_seen,
        "same_name": np.log1p(_add_up(asked.companions.same)),
        "log_room_size": np.log(np.maximum(room_size, 1)) * was_seen,
        "room_fraction": np.where(was_seen, room_size / arrays.num_places, 1.0),
        "most_believed": belief[:, :-1].max(axis=1),
        "elsewhere": belief[:, -1],
    }


def compute_hour(asked: Question) -> dict[str, np.ndarray]:
    """What time it is, and how often the thing is away from its usual place at that time.

    No columns where no home has a clock, and zeros in a home without one.
    """
    arrays, counts = asked.arrays, asked.counts
    if not counts.hours.shape[3]:
        return {}
    has_clock = ~np.isnan(arrays.hour)
    angle = np.where(has_clock, arrays.hour, 0.0) * _HOUR_ANGLE
    seen, gone = (counts.hours * arrays.narrow[:, None]).sum(axis=3)
    query, usual = np.arange(len(seen)), counts.num_true.argmax(axis=1)
    last = np.maximum(arrays.last, 0)
    total = _add_up(seen)
    away = (total - seen[query, usual] + 0.3) / (total + 1)
    gone_at_last = (gone[query, last] + 0.3) / (gone[query, last] + seen[query, last] + 1)
    return {
        "has_clock": has_clock,
        "hour_sine": np.sin(angle) * has_clock,
        "hour_cosine": np.cos(angle) * has_clock,
        "away_at_this_hour": away * has_clock,
        "gone_at_this_hour": gone_at_last * (has_clock & (arrays.num_seen > 0)),
    }


def _add_up(values: np.ndarray) -> np.ndarray:
    """Sum rows from first to last, (Q, F) -> (Q,)."""
    return add_in_order(values)[:, 0]

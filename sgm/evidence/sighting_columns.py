"""Columns of places: what was seen of the thing there, and when.

Each function computes the columns of a group of `sgm.evidence.columns`, by name, (Q, F) each.
"""

from __future__ import annotations

import numpy as np

from sgm.arrays.rows import add_in_order, rank_rows
from sgm.evidence.question import Question

_MOST = 1 - 1e-3  # of a presence: odds stay finite
_LEAST_AWAY = 0.02  # of a share of the time: a rate stays finite


def compute_sightings(asked: Question) -> dict[str, np.ndarray]:
    """Where the thing was seen, how often and in which order."""
    looks, last = asked.arrays.looks, asked.arrays.last[:, None]
    count = asked.counts.num_true
    was_seen = count > 0
    place, usual = np.arange(count.shape[1]), count.argmax(axis=1)[:, None]
    is_usual = (place == usual) & was_seen
    return {
        "num_true": np.log1p(count),
        "share": count / np.maximum(asked.arrays.num_seen, 1)[:, None],
        "per_look": count / (looks + 1),
        "per_look_smooth": (count + 0.2) / (looks + 1),
        "is_last": place == last,
        "was_seen": was_seen,
        "share_rank": rank_rows(count) * was_seen,
        "recency_rank": rank_rows(asked.counts.last_true) * was_seen,
        "is_usual": is_usual,
        "is_usual_and_away": is_usual & (usual != last),
    }


def compute_looks(asked: Question) -> dict[str, np.ndarray]:
    """Looks at the place, and those that missed the thing since it was there."""
    looks, was_seen = asked.arrays.looks, asked.counts.num_true > 0
    absent = np.log1p(asked.counts.num_absent)
    total = np.maximum(looks.sum(axis=1, keepdims=True), 1)
    return {
        "absent_since_seen": absent * was_seen,
        "absent_never_seen": absent * ~was_seen,
        "looks": np.log1p(looks),
        "was_looked_at": looks > 0,
        "looks_share": looks / total * asked.arrays.num_places[:, None] / 4,
        "is_looked_at_since": was_seen & (asked.arrays.last_look > asked.counts.last_true),
    }


def compute_times(asked: Question) -> dict[str, np.ndarray]:
    """Time since the thing was there and since the place was looked at, in hours and in moves."""
    hours, now = asked.arrays.hours[:, None], asked.arrays.now
    home, own = asked.rates.home[:, None], asked.rates.own[:, None]
    seen = (now - asked.counts.last_true) * hours * (asked.counts.num_true > 0)
    looked = (now - asked.arrays.last_look) * hours * (asked.arrays.last_look >= 0)
    return {
        "hours_since_seen": np.log1p(seen),
        "home_moves_since_seen": -np.expm1(-home * seen),
        "own_moves_since_seen": -np.expm1(-own * seen),
        "hours_since_look": np.log1p(looked),
        "home_moves_since_look": -np.expm1(-home * looked),
        "own_moves_since_look": -np.expm1(-own * looked),
    }


def compute_stays(asked: Question) -> dict[str, np.ndarray]:
    """How long the thing stays at the place, and whether it is there by that alone.

    Presence is that of two states, there and not. They are left at a rate from the looks that
    found it gone, and balance at the share of the looks that found it. Places are independent.
    """
    arrays, counts, hours = asked.arrays, asked.counts, asked.arrays.hours[:, None]
    count, was_seen = counts.num_true, counts.num_true > 0
    left = (counts.num_left + 1) / (counts.time_true * hours + 1 / asked.rates.left[:, None])
    since_true = (arrays.now - counts.last_true) * hours * was_seen
    last = np.where(was_seen, counts.last_known, arrays.last_look)
    known = np.where(was_seen, counts.num_known, arrays.looks)
    usually = (count + arrays.goes[:, :-1]) / (known + 1)
    was_there = np.where(last >= 0, counts.is_true, usually)
    since_known = (arrays.now - np.maximum(last, 0)) * hours
    remains = np.exp(-left / (1 - usually + _LEAST_AWAY) * since_known)
    presence = np.minimum(usually + (was_there - usually) * remains, _MOST)
    odds = presence / (1 - presence) * arrays.is_place
    return {
        "num_left": np.log1p(counts.num_left),
        "left_since_seen": -np.expm1(-left * since_true),
        "per_known_look": count / np.maximum(counts.num_known, 1),
        "presence": presence,
        "log_presence": arrays.log_share(odds / add_in_order(odds)),
    }


def compute_hours(asked: Question) -> dict[str, np.ndarray]:
    """Where the thing was seen at this hour of the day, and where others that are out of place.

    Its presence is the share of the looks at about this hour that showed it. No columns where no
    home has a clock.
    """
    arrays, counts = asked.arrays, asked.counts
    if not counts.hours.shape[3]:
        return {}
    has_clock = ~np.isnan(arrays.hour)[:, None]
    usually = counts.num_true / np.maximum(counts.num_known, 1)
    columns = {}
    for name, weight in (("wide", arrays.wide), ("narrow", arrays.narrow)):
        seen, gone = (counts.hours * weight[:, None]).sum(axis=3)
        columns[f"hour_{name}"] = seen / np.maximum(add_in_order(seen * arrays.is_place), 0.3)
        columns[f"log_hour_{name}"] = np.log1p(seen)
        columns[f"presence_{name}"] = (seen + usually) / (seen + gone + 1) * has_clock
    strays = arrays.stray_hours / (add_in_order(arrays.stray_hours) + 0.5)
    columns["strays_at_hour"] = strays
    columns["log_strays_at_hour"] = arrays.log_share(strays) * has_clock
    return columns

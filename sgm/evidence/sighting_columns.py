"""What was seen of the thing itself, at each place and anywhere, and when.

Each function computes the columns of a group of `sgm.evidence.columns`, by name: of places,
(Q, F) each, or of the question, (Q,) each, or both.
"""

from __future__ import annotations

import math

import numpy as np

from sgm.evidence.adaptive_filter import RANKING, TASKS_ASK_MOVED, Rates
from sgm.evidence.companions import Companions
from sgm.evidence.expected_places import Expected
from sgm.evidence.question import Question, compute_hour, weigh_hour
from sgm.evidence.rows import add_in_order, log_share, rank_rows, share_most

_MOST = 1 - 1e-3  # of a presence: odds stay finite
_LEAST_ODDS = 1e-12  # of all places together: they are 0 where all were found empty just now
_LEAST_AWAY = 0.02  # of a share of the time: a rate stays finite
_HOUR_ANGLE = 2 * math.pi / 24


def compute_looks(asked: Question) -> dict[str, np.ndarray]:
    """Looks at the place, and those that missed the thing since it was there."""
    looks, was_seen = asked.looks, asked.counts.num_true > 0
    absent = np.log1p(asked.counts.num_absent)
    total = np.maximum(looks.sum(axis=1, keepdims=True), 1)
    return {
        "absent_since_seen": absent * was_seen,
        "absent_never_seen": absent * ~was_seen,
        "looks": np.log1p(looks),
        "was_looked_at": looks > 0,
        "looks_share": looks / total * asked.num_places[:, None] / 4,
        "is_looked_at_since": was_seen & (asked.last_look > asked.counts.last_true),
    }


def compute_times(asked: Question, rates: Rates) -> dict[str, np.ndarray]:
    """Time since the thing was there and since the place was looked at, in hours and in moves."""
    hours, now = asked.hours[:, None], asked.memory.time
    home, thing = rates.home[:, None], rates.thing[:, None]
    seen = (now - asked.counts.last_true) * hours * (asked.counts.num_true > 0)
    looked = (now - asked.last_look) * hours * (asked.last_look >= 0)
    return {
        "hours_since_seen": np.log1p(seen),
        "home_moves_since_seen": -np.expm1(-home * seen),
        "own_moves_since_seen": -np.expm1(-thing * seen),
        "hours_since_look": np.log1p(looked),
        "home_moves_since_look": -np.expm1(-home * looked),
        "own_moves_since_look": -np.expm1(-thing * looked),
    }


def compute_movement(asked: Question, rates: Rates, asks_moved: float) -> dict[str, np.ndarray]:
    """How fast things move here, and how much this one may have moved since it was seen.

    How likely anything has moved counts as far as questions are about that (`asks_moved`).
    """
    was_seen, hours = asked.num_seen > 0, _count_hours_since_seen(asked)
    return {
        "log_home_rate": np.log(rates.home),
        "log_own_rate": np.log(rates.thing),
        "own_moves": np.log1p(asked.memory.objects["num_moved"][asked.thing]),
        "hours_since_seen": np.log1p(hours),
        "home_moves_since_seen": np.where(was_seen, -np.expm1(-rates.home * hours), 1.0),
        "own_moves_since_seen": np.where(was_seen, -np.expm1(-rates.thing * hours), 1.0),
        "any_moved": rates.any_moved * (asks_moved / TASKS_ASK_MOVED),
        "crossing": rates.crossing,
        "moves": np.log1p(asked.sums.arrivals[asked.home].sum(axis=1)),
        "miss_rate": rates.miss,
    }


def _count_hours_since_seen(asked: Question) -> np.ndarray:
    """Return the time since the last sighting, 0 for none, (Q,)."""
    steps = asked.memory.time - asked.memory.objects["last_observed"][asked.thing]
    return steps * asked.hours * (asked.num_seen > 0)


def compute_sightings(asked: Question) -> dict[str, np.ndarray]:
    """Where the thing was seen, how often and in which order."""
    looks, last = asked.looks, asked.last[:, None]
    count = asked.counts.num_true
    was_seen = count > 0
    is_last = np.arange(count.shape[1]) == last
    usual = share_most(count) * was_seen
    return {
        "num_true": np.log1p(count),
        "share": count / np.maximum(asked.num_seen, 1)[:, None],
        "per_look": count / (looks + 1),
        "per_look_smooth": (count + 0.2) / (looks + 1),
        "is_last": is_last,
        "was_seen": was_seen,
        "share_rank": rank_rows(count, asked.is_place) * was_seen,
        "recency_rank": rank_rows(asked.counts.last_true, asked.is_place) * was_seen,
        "is_usual": usual,
        "is_usual_and_away": usual * ~is_last,
    }


def compute_stays(
    asked: Question, rates: Rates, destinations: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """How long the thing stays at the place, and whether it is there by that alone.

    Presence is that of two states, there and not. They are left at a rate from the looks that
    found it gone, and balance at the share of the looks that found it. Places are independent.

    Of the question: how long things stay here, and this one; how often it was gone when asked for.
    """
    counts, hours, now = asked.counts, asked.hours[:, None], asked.memory.time
    # One look may show it in two relations.
    count, was_seen = np.minimum(counts.num_true, counts.num_known), counts.num_true > 0
    left = (counts.num_left + 1) / (counts.time_true * hours + 1 / rates.left[:, None])
    since_true = (now - counts.last_true) * hours * was_seen
    last = np.where(was_seen, counts.last_known, asked.last_look)
    known = np.where(was_seen, counts.num_known, asked.looks)
    usually = (count + destinations[:, :-1]) / (known + 1)
    was_there = np.where(last >= 0, counts.is_true, usually)
    since_known = (now - np.maximum(last, 0)) * hours
    remains = np.exp(-left / (1 - usually + _LEAST_AWAY) * since_known)
    presence = np.minimum(usually + (was_there - usually) * remains, _MOST)
    odds = presence / (1 - presence) * asked.is_place
    total = np.maximum(add_in_order(odds), _LEAST_ODDS)
    per_known_look = count / np.maximum(counts.num_known, 1)
    since_seen = _count_hours_since_seen(asked)
    num_placed = add_in_order(per_known_look)[:, 0]
    of_places = {
        "num_left": np.log1p(counts.num_left),
        "left_since_seen": -np.expm1(-left * since_true),
        "per_known_look": per_known_look,
        "presence": presence,
        "log_presence": log_share(odds / total, asked.num_places),
    }
    objects = asked.memory.objects
    num_sought, num_still = objects["num_sought"][asked.thing], objects["num_still"][asked.thing]
    return of_places, {
        "log_home_left_rate": np.log(rates.home_left),
        "log_left_rate": np.log(rates.left),
        "num_left_anywhere": np.log1p(counts.num_left.sum(axis=1)),
        "left_since_last_seen": -np.expm1(-rates.left * since_seen),
        "unplaced": np.where(asked.num_seen > 0, np.maximum(1 - num_placed, 0.0), 1.0),
        "num_sought": np.log1p(num_sought),
        "still_there": (num_still + 0.5) / (num_sought + 1),
    }


def compute_object(
    asked: Question, expected: Expected, companions: Companions, beliefs: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Where the thing tends to be, how sure that is, and what filters say in sum."""
    counts, num_seen, belief = asked.counts, asked.num_seen, beliefs[RANKING]
    was_seen, share = num_seen > 0, counts.num_true / np.maximum(num_seen, 1)[:, None]
    room_size = asked.is_in_last_room.sum(axis=1)
    usual = share_most(counts.num_true)
    absent_at_last = counts.num_absent[np.arange(len(share)), np.maximum(asked.last, 0)]
    sums = add_in_order(np.stack([share * np.log(share + 1e-9), companions.same]))
    negative_entropy, num_same = sums[..., 0]
    return {
        "was_seen": was_seen,
        "num_seen": np.log1p(num_seen),
        "num_seen_places": np.log1p((counts.num_true > 0).sum(axis=1)),
        "entropy": -negative_entropy,
        "most": share.max(axis=1),
        "most_prior": expected.share.max(axis=1),
        "is_usual_last": was_seen * usual[np.arange(len(share)), np.maximum(asked.last, 0)],
        "absent_at_last": np.log1p(absent_at_last) * was_seen,
        "same_name": np.log1p(num_same),
        "log_room_size": np.log(np.maximum(room_size, 1)) * was_seen,
        "room_fraction": np.where(was_seen, room_size / asked.num_places, 1.0),
        "most_believed": belief[:, :-1].max(axis=1),
        "elsewhere": belief[:, -1],
    }


def compute_hours(asked: Question) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Where the thing was seen at this hour of the day, and where others that are out of place.

    Its presence is the share of the looks at about this hour that showed it. Of the question: what
    time it is, and how often the thing is away from its usual place at that time. No columns where
    no home has a clock, and mostly zeros in a home without one.
    """
    counts, num_places = asked.counts, asked.num_places
    if asked.memory.clock is None:
        return {}, {}
    hour, strays = compute_hour(asked.memory, asked.home), _count_strays(asked)
    has_clock = ~np.isnan(hour)
    usually = counts.num_true / np.maximum(counts.num_known, 1)
    of_places = {}
    for name, width in (("wide", 3.0), ("narrow", 8.0)):
        seen, gone = (counts.hours * weigh_hour(hour, width)[:, None]).sum(axis=3)
        total = np.maximum(add_in_order(seen * asked.is_place), 0.3)
        of_places[f"hour_{name}"] = seen / total
        of_places[f"log_hour_{name}"] = np.log1p(seen)
        of_places[f"presence_{name}"] = (seen + usually) / (seen + gone + 1) * has_clock[:, None]
    strays = strays / (add_in_order(strays) + 0.5)
    of_places["strays_at_hour"] = strays
    of_places["log_strays_at_hour"] = log_share(strays, num_places) * has_clock[:, None]
    angle = np.where(has_clock, hour, 0.0) * _HOUR_ANGLE
    query, usual = np.arange(len(seen)), share_most(counts.num_true)
    last, num_seen = np.maximum(asked.last, 0), add_in_order(seen)[:, 0]  # at the narrow hour
    seen_at_usual = add_in_order(seen * usual)[:, 0]
    away = (num_seen - seen_at_usual + 0.3) / (num_seen + 1)
    gone_at_last = (gone[query, last] + 0.3) / (gone[query, last] + seen[query, last] + 1)
    return of_places, {
        "has_clock": has_clock,
        "hour_sine": np.sin(angle) * has_clock,
        "hour_cosine": np.cos(angle) * has_clock,
        "away_at_this_hour": away * has_clock,
        "gone_at_this_hour": gone_at_last * (has_clock & (asked.num_seen > 0)),
    }


def _count_strays(asked: Question) -> np.ndarray:
    """Count the sightings of things out of their usual places at about this hour of day, (Q, F)."""
    memory, edges = asked.memory, asked.memory.edges
    num_homes, num_places = memory.num_homes, memory.num_furniture
    most = np.zeros(memory.objects.num_rows, dtype=np.int32)
    np.maximum.at(most, edges["object"], edges["num_true"])
    rows = np.flatnonzero((edges["num_true"] > 0) & (edges["num_true"] < most[edges["object"]]))
    home = edges["home"][rows]
    weight = weigh_hour(compute_hour(memory, np.arange(num_homes)))[home]
    seen = (asked.history.get_edge_hours(rows)[0] * weight).sum(axis=1)
    place = home * num_places + edges["furniture"][rows]
    counts = np.bincount(place, seen, minlength=num_homes * num_places)
    return counts.reshape(num_homes, num_places)[asked.home]

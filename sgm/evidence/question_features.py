"""What the memory says about a question as a whole: the home, its prior, the object asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED, weigh_hours
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.place_features import Columns, sum_by_room
from sgm.evidence.question import Question


def compute_size(question: Question) -> Columns:
    """How large the home is, and how much of it is known; columns are (Q,)."""
    num_known = question.num_known[:, 0]
    objects = question.memory.objects
    sightings = np.bincount(
        objects["home"], objects["num_observed"], minlength=question.memory.num_homes
    )[question.queries.home]
    age = question.memory.time * question.hours[:, 0]
    num_rooms = question.memory.home_num_rooms[question.queries.home]
    return {
        "log_num_places": np.log(question.num_places[:, 0]),
        "log_num_rooms": np.log(num_rooms),
        "num_known": np.log1p(num_known),
        "sightings_per_object": np.log1p(sightings / np.maximum(num_known, 1)),
        "age": np.log1p(age),
        "log_step": np.log(question.hours[:, 0]),
    }


def compute_movement(question: Question) -> Columns:
    """How fast things move here, and how much this one may have moved since it was seen.

    `any_moved` is zero where what has just moved is not asked for more often than other things.
    """
    rates, last_seen = question.rates, question.memory.objects["last_observed"]
    was_seen = question.was_seen[:, 0]
    since = question.memory.time - last_seen[question.queries.object]
    since = np.where(was_seen, since, 0) * question.hours[:, 0]
    moved = question.memory.objects["num_moved"][question.queries.object]
    return {
        "log_home_rate": np.log(rates.home),
        "log_own_rate": np.log(rates.own),
        "own_moves": np.log1p(moved),
        "hours_since_seen": np.log1p(since),
        "home_moves_since_seen": np.where(was_seen, -np.expm1(-rates.home * since), 1),
        "own_moves_since_seen": np.where(was_seen, -np.expm1(-rates.own * since), 1),
        "any_moved": rates.any_moved * (question.asks_moved / TASKS_ASK_MOVED),
        "crossing": rates.crossing,
        "moves": np.log1p(question.moves.sum(axis=(1, 2))),
        "miss_rate": rates.miss,
    }


def compute_stays(question: Question) -> Columns:
    """How long things stay here, and this one; how often it was gone when it was asked for."""
    counts, rates, objects = question.counts, question.rates, question.memory.objects
    row = question.queries.object
    was_seen = question.was_seen[:, 0]
    since = np.where(was_seen, question.memory.time - objects["last_observed"][row], 0)
    placed = (counts.num_true / np.maximum(counts.num_known, 1)).sum(axis=1)
    num_sought = objects["num_sought"][row]
    return {
        "log_home_left_rate": np.log(rates.home_left),
        "log_left_rate": np.log(rates.left),
        "num_left_anywhere": np.log1p(counts.num_left.sum(axis=1)),
        "left_since_last_seen": -np.expm1(-rates.left * since * question.hours[:, 0]),
        "unplaced": np.where(was_seen, np.maximum(1 - placed, 0), 1),
        "num_sought": np.log1p(num_sought),
        "still_there": (objects["num_still"][row] + 0.5) / (num_sought + 1),
    }


def compute_trust(question: Question) -> Columns:
    """How well simple rules and the prior have done in this home."""
    memory, home = question.memory, question.queries.home
    counters = {name: column[home] for name, column in memory.history.counters.items()}
    edges = memory.edges
    rows = np.flatnonzero((edges["num_true"] > 0) & (memory.objects["type"][edges["object"]] >= 0))
    lift = np.log(edges["prior"][rows] * memory.home_num_furniture[edges["home"][rows]] * 0.9 + 0.1)
    num_homes = memory.num_homes
    num_placed = np.bincount(edges["home"][rows], minlength=num_homes)[home]
    lift = np.bincount(edges["home"][rows], lift, minlength=num_homes)[home]
    objects = memory.objects
    has_type = (objects["type"] >= 0) & (objects["num_observed"] > 0)
    num_typed = np.bincount(objects["home"][has_type], minlength=num_homes)[home]
    rights = ("num_last_right", "num_common_right", "num_prior_right")
    return {
        "has_prior": question.has_prior[:, 0],
        "known_share": num_typed / np.maximum(question.num_known[:, 0], 1),
        "num_placed": np.log1p(num_placed),
        "prior_lift": lift / (num_placed + 3),
        "found": (counters["num_found"] + 0.5) / (counters["num_asked"] + 1),
        **{name[4:]: (counters[name] + 0.5) / (counters["num_found"] + 1) for name in rights},
    }


def compute_words(question: Question) -> Columns:
    """Whether the prior knows the object, and how sure its name tells where it is kept."""
    expected = question.expected
    return {
        "is_known": expected.trust == 1,
        "name_cosine": expected.name_cosine,
        "most_by_name": expected.by_name.max(axis=1),
        "similar_known": np.log1p(question.similar.sum(axis=1)),
        "most_similar": question.most_similar,
    }


def compute_object(question: Question) -> Columns:
    """Where the object tends to be, how sure that is, and what filters say in sum."""
    share, last, was_seen = question.share, question.last, question.was_seen[:, 0]
    absent = np.log1p(question.take_at(question.counts.num_absent, last))
    size = sum_by_room(question, question.is_place.astype(float))
    room_size = question.take_at(size, last)
    asked = question.get_belief("asked")
    return {
        "was_seen": was_seen,
        "num_seen": np.log1p(question.num_seen[:, 0]),
        "num_seen_places": np.log1p((share > 0).sum(axis=1)),
        "entropy": -(share * np.log(share + 1e-9)).sum(axis=1),
        "most": share.max(axis=1),
        "most_prior": question.prior.max(axis=1),
        "is_usual_last": (question.usual == last) & was_seen,
        "absent_at_last": np.where(was_seen, absent, 0),
        "same_name": np.log1p(question.same.sum(axis=1)),
        "log_room_size": np.where(was_seen, np.log(np.maximum(room_size, 1)), 0),
        "room_fraction": np.where(was_seen, room_size / question.num_places[:, 0], 1),
        "most_believed": asked.max(axis=1),
        "elsewhere": question.get_elsewhere("asked"),
    }


def compute_hour_of_day(question: Question) -> Columns:
    """What time it is, and how often the object is away from its usual place at that time."""
    memory, queries, hours = question.memory, question.queries, question.counts.hours
    now = compute_hour(memory, queries.home)
    has_clock, angle = ~np.isnan(now), now * (2 * np.pi / 24)
    away, gone = np.zeros((2, len(now)))
    if hours is not None:
        seen, vain = weigh_hours(memory, queries, hours, 8.0)
        total = seen.sum(axis=1)
        away = (total - question.take_at(seen, question.usual) + 0.3) / (total + 1)
        away = np.where(has_clock, away, 0)
        vain = question.take_at(vain, question.last)
        gone = (vain + 0.3) / (vain + question.take_at(seen, question.last) + 1)
        gone = np.where(has_clock & question.was_seen[:, 0], gone, 0)
    return {
        "has_clock": has_clock,
        "hour_sine": np.where(has_clock, np.sin(angle), 0),
        "hour_cosine": np.where(has_clock, np.cos(angle), 0),
        "away_at_this_hour": away,
        "gone_at_this_hour": gone,
    }


QUESTION_GROUPS: Mapping[str, Callable[[Question], Columns]] = {
    "size": compute_size,
    "movement": compute_movement,
    "stays": compute_stays,
    "trust": compute_trust,
    "words": compute_words,
    "object": compute_object,
    "hour": compute_hour_of_day,
}

"""What the memory says about each place where an object that is asked for may be.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month. Each function is a group that can be switched off.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sgm.evidence.adaptive_filter import weigh_hours
from sgm.evidence.columns import PLACE_GROUP_COLUMNS
from sgm.evidence.expected_places import share_out
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.question import FILTERS, Question

Columns = dict[str, np.ndarray]  # each (Q, F)

_MOST = 1 - 1e-3  # of a presence: odds stay finite
_LEAST = 0.02  # of a share times the number of places, in logarithms


def compute_sightings(question: Question) -> Columns:
    """Where the object was seen, how often and in which order."""
    counts = question.counts
    seen = counts.num_true > 0
    usual = question.is_at(question.usual) & question.was_seen
    is_away = (question.usual != question.last)[:, None]
    return {
        "num_true": np.log1p(counts.num_true),
        "share": question.share,
        "per_look": counts.num_true / (question.looks + 1),
        "per_look_smooth": (counts.num_true + 0.2) / (question.looks + 1),
        "is_last": question.is_at(question.last),
        "was_seen": seen,
        "share_rank": np.where(seen, rank(counts.num_true), 0),
        "recency_rank": np.where(seen, rank(counts.last_true), 0),
        "is_usual": usual,
        "is_usual_and_away": usual & is_away,
    }


def compute_looks(question: Question) -> Columns:
    """Looks at the place, and those that missed the object since it was there."""
    counts, looks = question.counts, question.looks
    seen = counts.num_true > 0
    absent = np.log1p(counts.num_absent)
    total = np.maximum(looks.sum(axis=1, keepdims=True), 1)
    return {
        "absent_since_seen": np.where(seen, absent, 0),
        "absent_never_seen": np.where(seen, 0, absent),
        "looks": np.log1p(looks),
        "was_looked_at": looks > 0,
        "looks_share": looks / total * question.num_places / 4,
        "is_looked_at_since": seen & (question.last_look > counts.last_true),
    }


def compute_times(question: Question) -> Columns:
    """Time since the object was there and since the place was looked at, in hours and in moves."""
    now, hours = question.memory.time, question.hours
    seen, looked = question.counts.num_true > 0, question.last_look >= 0
    since_seen = np.where(seen, now - question.counts.last_true, 0) * hours
    since_look = np.where(looked, now - question.last_look, 0) * hours
    home, own = question.rates.home[:, None], question.rates.own[:, None]
    return {
        "hours_since_seen": np.log1p(since_seen),
        "home_moves_since_seen": -np.expm1(-home * since_seen),
        "own_moves_since_seen": -np.expm1(-own * since_seen),
        "hours_since_look": np.log1p(since_look),
        "home_moves_since_look": -np.expm1(-home * since_look),
        "own_moves_since_look": -np.expm1(-own * since_look),
    }


def compute_stays(question: Question) -> Columns:
    """How long the object stays at the place, and whether it is there by that alone.

    Presence is that of two states, there and not, which are left at a rate from the looks that
    found it gone and balance at the share of the looks that found it, as if the places had nothing
    to do with each other.
    """
    counts, hours = question.counts, question.hours
    seen = counts.num_true > 0
    of_object = question.rates.left[:, None]
    left = (counts.num_left + 1) / (counts.time_true * hours + 1 / of_object)
    since_true = np.where(seen, question.memory.time - counts.last_true, 0) * hours
    last_look = np.where(seen, counts.last_known, question.last_look)
    since_look = (question.memory.time - np.maximum(last_look, 0)) * hours
    looks = np.where(seen, counts.num_known, question.looks)
    usually = (counts.num_true + question.goes) / (looks + 1)
    was_there = np.where(last_look >= 0, counts.is_true, usually)
    remains = np.exp(-left / (1 - usually + _LEAST) * since_look)
    presence = np.minimum(usually + (was_there - usually) * remains, _MOST) * question.is_place
    odds = presence / (1 - presence)
    return {
        "num_left": np.log1p(counts.num_left),
        "left_since_seen": -np.expm1(-left * since_true),
        "per_known_look": np.where(seen, counts.num_true / np.maximum(counts.num_known, 1), 0),
        "presence": presence,
        "log_presence": compute_log(odds / odds.sum(axis=1, keepdims=True), question),
    }


def compute_prior(question: Question) -> Columns:
    """The prior, and posteriors that trust it as so many looks.

    `place_share` is in proportion to how much of what is expected at a place is this thing: a place
    where all is kept has as much room as one where little is.
    """
    prior, has_prior = question.prior, question.has_prior
    crowding = question.memory.place_prior.crowding[question.queries.home]
    own = prior / np.maximum(crowding, 1e-6)
    place_share, _ = share_out(question.memory, question.queries, own)
    in_room = sum_by_room(question, prior)
    is_same_room = compute_is_same_room(question)
    columns = {
        "prior": prior,
        "log_prior": np.where(has_prior, compute_log(prior, question), 0),
        "prior_rank": np.where(has_prior, rank(prior), 0),
        "is_possible": prior > 0,
        "place_share": place_share,
        "log_place_share": np.where(has_prior, compute_log(place_share, question), 0),
        "place_share_rank": np.where(has_prior, rank(place_share), 0),
        "prior_in_room": np.where(is_same_room, prior / np.maximum(in_room, 1e-6), 0),
    }
    for strength in (0.5, 2, 8):
        weight = question.counts.num_true + strength * prior
        posterior = weight / (question.looks + strength)
        total = np.maximum(posterior.sum(axis=1, keepdims=True), 1e-6)
        columns[f"posterior_{strength:g}"] = posterior / total
    return columns


def compute_words(question: Question) -> Columns:
    """Where things of such names are kept by the prior and in this home, and the place's own."""
    similar = question.similar / (question.similar.sum(axis=1, keepdims=True) + 0.1)
    by_name, cosine = question.expected.by_name, question.expected.name_cosine[:, None]
    return {
        "by_name": by_name,
        "log_by_name": np.where(cosine > 0, compute_log(by_name, question), 0),
        "by_name_rank": np.where(cosine > 0, rank(by_name), 0),
        "similar_here": similar,
        "log_similar_here": compute_log(similar, question),
        "furniture_cosine": question.expected.furniture_cosine,
    }


def compute_filters(question: Question) -> Columns:
    """What the adaptive filters believe."""
    columns: Columns = {}
    beliefs = question.belief[:, :, :-1]
    logs = np.log(beliefs * question.num_places[:, None] + _LEAST)  # of all filters: one call
    for number, name in enumerate(FILTERS):
        columns[f"belief_{name}"] = beliefs[:, number]
        columns[f"log_belief_{name}"] = logs[:, number]
    columns["belief_rank"] = rank(question.get_belief("asked"))
    return columns


def compute_places(question: Question) -> Columns:
    """How much the place is used, and how often objects go there from where this one was."""
    arrivals = question.moves.sum(axis=1)
    total = arrivals.sum(axis=1, keepdims=True)
    popularity = question.popularity / np.maximum(question.num_known, 1)
    row, last = np.arange(len(question.last)), np.maximum(question.last, 0)
    was_seen = question.was_seen
    onward = np.where(was_seen, question.moves[row, last], 0)
    back = np.where(was_seen, question.moves[row, :, last], 0)
    num_places = question.num_places
    return {
        "popularity": popularity,
        "log_popularity": np.log(popularity * num_places + 0.1),
        "arrivals": arrivals / np.maximum(total, 1),
        "log_arrivals": np.log((arrivals + 0.5) / (total + 0.5 * num_places) * num_places),
        "onward": onward / np.maximum(onward.sum(axis=1, keepdims=True), 1),
        "log_onward": np.log1p(onward),
        "log_back": np.log1p(back),
    }


def compute_others(question: Question) -> Columns:
    """Where things of the same name, its companions, and what is out of its place were seen.

    Things of a name, this one among them, at furniture of the same label, in the room and in the
    home: what belongs on one shelf may belong on the next.
    """
    same, fresh, strays = question.same, question.fresh, question.strays
    is_most = question.share >= question.share.max(axis=1, keepdims=True)
    often = np.where(is_most, 0, question.often)
    label = question.memory.furniture_label[question.queries.home]
    is_alike = (label[:, :, None] == label[:, None, :]) & question.is_place[:, None, :]
    in_room = is_alike & (question.room[:, :, None] == question.room[:, None, :])
    named = (same + question.counts.num_true).astype(np.float32)
    by_label, by_room = (np.einsum("qfg,qg->qf", mask, named) for mask in (is_alike, in_room))
    looks = np.einsum("qfg,qg->qf", in_room, question.looks.astype(np.float32))
    total = np.maximum(named.sum(axis=1, keepdims=True), 1)
    return {
        "name_at_label": np.log1p(by_label),
        "name_at_label_share": by_label / total,
        "name_at_label_in_room": np.log1p(by_room),
        "looks_at_label_in_room": np.log1p(looks),
        "same_name": np.log1p(same),
        "same_name_share": same / np.maximum(same.sum(axis=1, keepdims=True), 1),
        "companions_now": fresh / np.maximum(fresh.sum(axis=1, keepdims=True), 0.5),
        "companions_often": often / np.maximum(often.sum(axis=1, keepdims=True), 0.5),
        "strays": np.log1p(strays),
        "strays_share": strays / (strays.sum(axis=1, keepdims=True) + 0.5),
    }


def compute_rooms(question: Question) -> Columns:
    """The room of the place."""
    size = sum_by_room(question, question.is_place.astype(float))
    return {
        "is_same_room": compute_is_same_room(question),
        "room_share": sum_by_room(question, question.share),
        "log_room_size": np.log(np.maximum(size, 1)),
    }


def compute_hours(question: Question) -> Columns:
    """Where the object was seen at this hour of the day, and where others that are out of place.

    Its presence is the share of the looks at about this hour that showed it. All is 0 where nobody
    knows what time it is.
    """
    columns: Columns = {}
    counts, memory, queries = question.counts, question.memory, question.queries
    if counts.hours is None:  # in none of the homes
        return dict.fromkeys(PLACE_GROUP_COLUMNS["hours"], np.zeros(question.is_place.shape))
    has_clock = ~np.isnan(compute_hour(memory, queries.home))[:, None]
    usually = counts.num_true / np.maximum(counts.num_known, 1)
    for name, width in (("wide", 3.0), ("narrow", 8.0)):
        seen, gone = weigh_hours(memory, queries, counts.hours, width)
        total = np.maximum(seen.sum(axis=1, keepdims=True), 0.3)
        columns[f"hour_{name}"] = seen / total
        columns[f"log_hour_{name}"] = np.log1p(seen)
        columns[f"presence_{name}"] = has_clock * (seen + usually) / (seen + gone + 1)
    strays = question.strays_at_hour
    share = strays / (strays.sum(axis=1, keepdims=True) + 0.5)
    columns["strays_at_hour"] = share
    columns["log_strays_at_hour"] = has_clock * compute_log(share, question)
    return columns


PLACE_GROUPS: Mapping[str, Callable[[Question], Columns]] = {
    "sightings": compute_sightings,
    "looks": compute_looks,
    "times": compute_times,
    "stays": compute_stays,
    "prior": compute_prior,
    "words": compute_words,
    "filters": compute_filters,
    "places": compute_places,
    "others": compute_others,
    "rooms": compute_rooms,
    "hours": compute_hours,
}


def rank(values: np.ndarray) -> np.ndarray:
    """Return 1 / rank of each place, the highest value 1, ties in order, (Q, F) -> (Q, F)."""
    from sgm.compiled.places import rank_places  # loads numba

    return rank_places(np.ascontiguousarray(values, dtype=float))


def compute_log(share: np.ndarray, question: Question) -> np.ndarray:
    """Return the logarithm of shares against all places alike, (Q, F) -> (Q, F)."""
    return np.log(share * question.num_places + _LEAST)


def compute_is_same_room(question: Question) -> np.ndarray:
    """Mark the room where the object was last seen, bool (Q, F)."""
    last_room = question.take_at(question.room, question.last)[:, None]
    return (question.room == last_room) & question.was_seen & question.is_place


def sum_by_room(question: Question, values: np.ndarray) -> np.ndarray:
    """Return the sum over the room of each place, (Q, F) -> (Q, F)."""
    from sgm.compiled import places  # loads numba

    num_rooms = question.memory.room_label.shape[1]
    return places.sum_by_room(question.room, num_rooms, np.ascontiguousarray(values, dtype=float))

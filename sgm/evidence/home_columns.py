"""How the home is used: its size, its places, where things go, and what has changed lately.

Each function of columns computes a group of `sgm.evidence.columns`, by name: of places, (Q, F)
each, or of the question, (Q,) each, or both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.evidence.question import Question
from sgm.evidence.rows import add_in_order, log_share, sum_equal
from sgm.prior.copies import get_copies

SPANS = {"minutes": 1 / 6, "hours": 1.0, "days": 24.0}  # hours after which an event counts 1 / e
_USUAL_CHANGES = 0.1  # for each look, before anything was seen to change
_MOST_HOURS = 1e4  # since a thing moved; what never did counts as this
# Smaller homes are read as ones of this size. Between one room and two the network that ships sees
# so great a difference that a bathroom, which has to do with nothing, moved .15 of an answer; a
# home of three places it has never seen.
_FEWEST_ROOMS, _FEWEST_PLACES = 3, 4
_USUAL_DOUBLES = 0.05  # share of the things of a home known at two places, before any was seen


def compute_size(asked: Question) -> dict[str, np.ndarray]:
    """How large the home is, and how much of it is known."""
    home, hours = asked.home, asked.hours
    num_known, sightings = asked.sums.num_known[home], asked.sums.sightings[home]
    return {
        "log_num_places": np.log(np.maximum(asked.num_places, _FEWEST_PLACES)),
        "log_num_rooms": np.log(np.maximum(asked.num_rooms, _FEWEST_ROOMS)),
        "num_known": np.log1p(num_known),
        "sightings_per_object": np.log1p(sightings / np.maximum(num_known, 1)),
        "age": np.log1p(asked.memory.time * hours),
        "log_step": np.log(hours),
    }


def compute_places(asked: Question) -> dict[str, np.ndarray]:
    """How much the place is used, and how often things go there from where this one was."""
    home, sums, moves = asked.home, asked.sums, asked.history.moves
    num_places, was_seen = asked.num_places[:, None], asked.num_seen[:, None] > 0
    last = np.maximum(asked.last, 0)
    arrivals, onward, back = sums.arrivals[home], moves[home, last], moves[home, :, last]
    total = arrivals.sum(axis=1, keepdims=True)
    # Beside the things that are known, one that may be anywhere: the first tell little.
    popularity = (sums.popularity[home] + 1 / num_places) / (sums.num_known[home][:, None] + 1)
    return {
        "popularity": popularity,
        "log_popularity": np.log(popularity * num_places + 0.1),
        "arrivals": arrivals / np.maximum(total, 1),
        "log_arrivals": np.log((arrivals + 0.5) / (total + 0.5 * num_places) * num_places),
        "onward": onward / np.maximum(onward.sum(axis=1, keepdims=True), 1) * was_seen,
        "log_onward": np.log1p(onward) * was_seen,
        "log_back": np.log1p(back) * was_seen,
    }


def compute_copies(asked: Question) -> dict[str, np.ndarray]:
    """What homes have of such things, what this one has, and where this one is known to be now.

    Things are known at several places as long as the last look at each has shown them.
    """
    memory, objects, edges = asked.memory, asked.memory.objects, asked.memory.edges
    labels = [memory.labels[label] for label in objects["label"][asked.thing]]
    usual = np.array(list(map(get_copies, labels)), dtype=float).reshape(-1, 2)
    true_at = edges["object"][edges["is_true"]] * memory.num_furniture
    place = np.unique(true_at + edges["furniture"][edges["is_true"]])
    num_places = np.bincount(place // memory.num_furniture, minlength=objects.num_rows)
    num_double = np.bincount(objects["home"][num_places > 1], minlength=memory.num_homes)
    share = (num_double + 10 * _USUAL_DOUBLES) / (asked.sums.num_seen + 10)
    return {
        "most_things": np.log(usual[:, 0]),
        "most_alike": np.log(usual[:, 0] / usual[:, 1]),
        "num_places_now": np.log1p(asked.counts.is_true.sum(axis=1)),
        "double_share": share[asked.home],
    }


def compute_ways(asked: Question, likeness: np.ndarray) -> dict[str, np.ndarray]:
    """To which places things were moved from where this one was seen last.

    The thing itself, the last time it was; others, by how much their names are alike (`likeness` of
    `Companions`); any things, between furniture of the same labels as these two places.
    """
    itself, alike = _count_arrivals(asked, likeness)
    onward = _count_by_label(asked)
    columns = {"own": itself}
    label = asked.memory.furniture_label[asked.home]
    for name, counts in (("alike", alike), ("label", sum_equal(label, onward))):
        share = counts / np.maximum(add_in_order(counts), 1)
        columns[name] = share
        columns[f"log_{name}"] = log_share(share, asked.num_places)
    return columns


def _count_arrivals(asked: Question, likeness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count what came to each place from where things were last seen, zeros for what never was.

    Returns:
        Whether the thing itself did, the last time it moved, and how many others did, weighted by
        how much their names are alike, (Q, F) each.
    """
    objects, edges = asked.memory.objects, asked.memory.edges
    num_queries, num_places = asked.is_place.shape
    itself, alike = np.zeros((2, num_queries, num_places))
    rows = np.flatnonzero(edges["came_from"] >= 0)
    if not len(rows):
        return itself, alike
    # Edges by the place that a thing came from, and questions by that where it was last seen.
    key = edges["home"][rows].astype(np.int64) * num_places + edges["came_from"][rows]
    order = np.argsort(key, kind="stable")
    rows, key = rows[order], key[order]
    wanted = asked.home.astype(np.int64) * num_places + asked.last
    wanted = np.where(asked.last >= 0, wanted, -1)
    first, end = np.searchsorted(key, wanted), np.searchsorted(key, wanted, side="right")
    count = end - first
    query = np.repeat(np.arange(num_queries), count)
    within = np.arange(len(query)) - np.repeat(np.cumsum(count) - count, count)
    edge = rows[np.repeat(first, count) + within]
    place, thing = edges["furniture"][edge], edges["object"][edge]
    is_itself = thing == asked.thing[query]
    itself[query[is_itself], place[is_itself]] = 1
    weight = likeness[query, objects["label"][thing]] * ~is_itself
    np.add.at(alike, (query, place), weight)
    return itself, alike


def _count_by_label(asked: Question) -> np.ndarray:
    """Count moves to each place from furniture of the label of where the thing was last, (Q, F)."""
    if not asked.sums.arrivals.any():
        return np.zeros(asked.is_place.shape)
    home, last, label = asked.home, asked.last, asked.memory.furniture_label[asked.home]
    last_label = label[np.arange(len(home)), np.maximum(last, 0)]
    is_from = (label == last_label[:, None]) & (last >= 0)[:, None]  # (Q, F)
    moves = asked.history.moves
    moves = moves[home] if len(moves) > 1 else moves[0]  # (Q, F, F) or (F, F)
    onward: np.ndarray = np.matmul(is_from[:, None].astype(float), moves)[:, 0]
    return onward  # whole numbers


def compute_rooms(asked: Question) -> dict[str, np.ndarray]:
    """The room of the place."""
    num_seen = np.maximum(asked.num_seen, 1)[:, None]
    size = np.maximum(sum_equal(asked.room, asked.is_place), 1)
    return {
        "is_same_room": asked.is_in_last_room,
        "room_share": sum_equal(asked.room, asked.counts.num_true) / num_seen,
        "log_room_size": np.log(size),
    }


class Changes(NamedTuple):
    """What looks have found changed over the last minutes, hours and days, in each of H homes.

    Things move in bursts, while people are there. What was found moved, or gone from where it was,
    tells that they are. Each counts exp(-age / span), for every one of `SPANS`; so do looks.

    Attributes:
        looks: (S, H).
        places: changes at each place, (S, H, F).
    """

    looks: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, asked: Question) -> Changes:
        """Count those of all homes; once, of a memory whose content does not change."""
        kept, key = asked.memory.derived, (cls, asked.memory.time)
        if kept is None:
            return cls._compute(asked)
        if key not in kept:
            kept[key] = cls._compute(asked)
        changes: Changes = kept[key]
        return changes

    @classmethod
    def _compute(cls, asked: Question) -> Changes:
        memory, step_hours, times = asked.memory, asked.step_hours, asked.history.look_times
        objects, edges = memory.objects, memory.edges
        num_homes, num_places = memory.num_homes, memory.num_furniture
        came = np.flatnonzero((objects["last_moved"] >= 0) & (objects["last_furniture"] >= 0))
        left = np.flatnonzero((edges["last_changed"] >= 0) & ~edges["is_true"])
        home = np.concatenate([objects["home"][came], edges["home"][left]])
        place = np.concatenate([objects["last_furniture"][came], edges["furniture"][left]])
        when = np.concatenate([objects["last_moved"][came], edges["last_changed"][left]])
        age = (memory.time - when) * step_hours[home]
        look_age = (memory.time - times) * step_hours[:, None, None]
        looks = np.empty((len(SPANS), num_homes))
        places = np.empty((len(SPANS), num_homes, num_places))
        cell = home.astype(np.int64) * num_places + place
        for number, span in enumerate(SPANS.values()):
            counts = np.bincount(cell, np.exp(-age / span), num_homes * num_places)
            places[number] = counts.reshape(num_homes, num_places)
            weight = (np.exp(-look_age / span) * (times >= 0)).reshape(num_homes, -1)
            looks[number] = add_in_order(weight)[:, 0]
        return cls(looks=looks, places=places)


def compute_lately(
    asked: Question, asks_moved: float
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """What has changed lately at each place, and in the home, by itself and for each look.

    The latter with whether this thing has, and whether questions are about that.
    """
    changes, home = Changes.of(asked), asked.home
    at_places = changes.places[:, home]
    in_home, looks = add_in_order(at_places)[..., 0], changes.looks[:, home]
    minutes, hours, _ = np.log1p(at_places)
    moved = asked.memory.objects["last_moved"][asked.thing]
    since = np.where(moved >= 0, (asked.memory.time - moved) * asked.hours, np.inf)
    rates = np.log((in_home + _USUAL_CHANGES) / (looks + 1))
    columns = dict(zip([f"changes_{span}" for span in SPANS], np.log1p(in_home), strict=True))
    columns |= zip([f"rate_{span}" for span in SPANS], rates, strict=True)
    return {"changes_minutes": minutes, "changes_hours": hours}, columns | {
        "hours_since_moved": np.log1p(np.minimum(since, _MOST_HOURS)),
        "moved_lately": np.exp(-since / SPANS["hours"]),
        "asks_moved": np.full(len(since), asks_moved),
    }

"""Columns of places: how the home uses them, and where other things are.

Each function computes the columns of a group of `sgm.evidence.columns`, by name, (Q, F) each.
"""

from __future__ import annotations

import numpy as np

from sgm.arrays.rows import add_in_order, sum_equal
from sgm.evidence.question import Question


def compute_places(asked: Question) -> dict[str, np.ndarray]:
    """How much the place is used, and how often things go there from where this one was."""
    arrays, sums = asked.arrays, asked.sums
    num_places, was_seen = arrays.num_places[:, None], arrays.num_seen[:, None] > 0
    arrivals, onward = sums.arrivals[arrays.home], arrays.onward
    total = arrivals.sum(axis=1, keepdims=True)
    num_known = np.maximum(sums.num_known[arrays.home], 1)[:, None]
    popularity = sums.popularity[arrays.home] / num_known
    return {
        "popularity": popularity,
        "log_popularity": np.log(popularity * num_places + 0.1),
        "arrivals": arrivals / np.maximum(total, 1),
        "log_arrivals": np.log((arrivals + 0.5) / (total + 0.5 * num_places) * num_places),
        "onward": onward / np.maximum(onward.sum(axis=1, keepdims=True), 1) * was_seen,
        "log_onward": np.log1p(onward) * was_seen,
        "log_back": np.log1p(arrays.back) * was_seen,
    }


def compute_others(asked: Question) -> dict[str, np.ndarray]:
    """Where things of the same name, its companions, and what is out of its place were seen.

    Things of a name, this one among them, at furniture of the same label, in the room and in the
    home: what belongs on one shelf may belong on the next.
    """
    arrays, companions, count = asked.arrays, asked.companions, asked.counts.num_true
    is_place, same = arrays.is_place, companions.same
    named = (same + count) * is_place
    is_usual = count == count.max(axis=1, keepdims=True)
    often = companions.often * ~is_usual * is_place
    # A number for each label, and for each label in a room: rooms have small ones.
    label = np.where(is_place, arrays.label, -1).astype(np.int64)
    num_rooms = int(arrays.room.max(initial=0)) + 1
    label_in_room = np.where(is_place, label * num_rooms + arrays.room, -1)
    at_label = sum_equal(label, named)
    return {
        "name_at_label": np.log1p(at_label),
        "name_at_label_share": at_label / np.maximum(add_in_order(named), 1),
        "name_at_label_in_room": np.log1p(sum_equal(label_in_room, named)),
        "looks_at_label_in_room": np.log1p(sum_equal(label_in_room, arrays.looks * is_place)),
        "same_name": np.log1p(same),
        "same_name_share": same / np.maximum(add_in_order(same * is_place), 1),
        "companions_now": companions.fresh
        / np.maximum(add_in_order(companions.fresh * is_place), 0.5),
        "companions_often": often / np.maximum(add_in_order(often), 0.5),
        "strays": np.log1p(companions.strays),
        "strays_share": companions.strays / (add_in_order(companions.strays) + 0.5),
    }


def compute_rooms(asked: Question) -> dict[str, np.ndarray]:
    """The room of the place."""
    arrays = asked.arrays
    num_seen = np.maximum(arrays.num_seen, 1)[:, None]
    size = np.maximum(sum_equal(arrays.room, arrays.is_place), 1)
    return {
        "is_same_room": arrays.is_in_last_room,
        "room_share": sum_equal(arrays.room, asked.counts.num_true) / num_seen,
        "log_room_size": np.log(size),
    }

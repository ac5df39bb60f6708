"""What the memory says about each place where an object that is asked for may be.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.evidence import place_columns_kernel as places
from sgm.evidence import sighting_columns_kernel as sightings
from sgm.evidence.adaptive_filter import weigh_hour
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.question import ASKED, Question
from sgm.memory.memory_batch import MemoryBatch


def fill_place_features(out: Mapping[str, np.ndarray], asked: Question) -> None:
    """Fill the columns of every group, float32 (Q, F, columns of the group), zeros at first.

    The hours stay 0 where the time is unknown.
    """
    counts, expected, memory, home = asked.counts, asked.expected, asked.memory, asked.queries.home
    is_place, num_true, last_true = asked.is_place, counts.num_true, counts.last_true
    last, num_places, room = asked.last, asked.num_places, asked.room
    looks, last_look = memory.furniture_num_observed[home], memory.furniture_last_observed[home]
    num_rooms = memory.room_label.shape[1]
    moves, left = memory.history.moves, np.maximum(last, 0)
    sightings.fill_sightings(out["sightings"], is_place, num_true, last_true, looks, last)
    sightings.fill_looks(
        out["looks"], is_place, num_true, last_true, counts.num_absent, looks, last_look,
        num_places,
    )  # fmt: skip
    sightings.fill_times(
        out["times"], is_place, num_true, last_true, last_look, memory.time, asked.hours,
        asked.rates.home, asked.rates.own,
    )  # fmt: skip
    sightings.fill_stays(
        out["stays"], is_place, num_true, last_true, counts.num_left, counts.time_true,
        counts.num_known, counts.last_known, counts.is_true, looks, last_look, asked.goes,
        num_places, memory.time, asked.hours, asked.rates.left,
    )  # fmt: skip
    places.fill_prior(
        out["prior"], is_place, num_true, looks, expected.share, expected.trust,
        memory.place_prior.crowding, home, room, num_rooms, last, num_places,
    )  # fmt: skip
    places.fill_words(
        out["words"], is_place, expected.by_name, expected.name_cosine, asked.similar,
        expected.furniture_cosine, num_places,
    )  # fmt: skip
    places.fill_filters(out["filters"], is_place, asked.belief, ASKED, num_places)
    places.fill_places(
        out["places"], is_place, asked.sums.popularity[home], asked.sums.arrivals[home],
        moves[home, left], moves[home, :, left], asked.num_known, asked.num_seen, num_places,
    )  # fmt: skip
    places.fill_others(
        out["others"], is_place, num_true, looks, asked.same, asked.fresh, asked.often,
        asked.strays, memory.furniture_label, room, home,
    )  # fmt: skip
    places.fill_rooms(out["rooms"], is_place, num_true, asked.num_seen, room, num_rooms, last)
    if counts.hours is not None:
        sightings.fill_hours(
            out["hours"], is_place, num_true, counts.num_known, counts.hours,
            weigh_hour(memory, home, 3.0), weigh_hour(memory, home, 8.0),
            ~np.isnan(compute_hour(memory, home)), _count_strays(memory)[home], num_places,
        )  # fmt: skip


def _count_strays(memory: MemoryBatch) -> np.ndarray:
    """Count the sightings of things out of their usual places at about this hour of day, (H, F)."""
    edges, num_homes, num_places = memory.edges, memory.num_homes, memory.num_furniture
    most = np.zeros(len(memory.objects), dtype=np.int32)
    np.maximum.at(most, edges["object"], edges["num_true"])
    rows = np.flatnonzero((edges["num_true"] > 0) & (edges["num_true"] < most[edges["object"]]))
    home = edges["home"][rows]
    weight = weigh_hour(memory, np.arange(num_homes))[home]
    seen = (memory.history.get_edge_hours(rows)[0] * weight).sum(axis=1)
    place = home * num_places + edges["furniture"][rows]
    counts = np.bincount(place, seen, minlength=num_homes * num_places)
    return counts.reshape(num_homes, num_places)

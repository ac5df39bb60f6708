"""What the memory says about each place where an object that is asked for may be.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month. Each function fills a group that can be switched
off: `out` is float32 (Q, F, columns of the group), zeros at first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sgm.evidence import place_columns_kernel, sighting_columns_kernel
from sgm.evidence.adaptive_filter import weigh_hour
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.question import FILTERS, Question

ASKED = list(FILTERS).index("asked")


def fill_sightings(out: np.ndarray, question: Question) -> None:
    """Where the object was seen, how often and in which order."""
    asked, counts = question, question.counts
    sighting_columns_kernel.fill_sightings(
        out, asked.is_place, counts.num_true, counts.last_true, asked.looks, asked.last
    )  # fmt: skip


def fill_looks(out: np.ndarray, question: Question) -> None:
    """Looks at the place, and those that missed the object since it was there."""
    asked, counts = question, question.counts
    sighting_columns_kernel.fill_looks(
        out, asked.is_place, counts.num_true, counts.last_true, counts.num_absent, asked.looks,
        asked.last_look, asked.num_places,
    )  # fmt: skip


def fill_times(out: np.ndarray, question: Question) -> None:
    """Time since the object was there and since the place was looked at, in hours and in moves."""
    asked, counts = question, question.counts
    sighting_columns_kernel.fill_times(
        out, asked.is_place, counts.num_true, counts.last_true, asked.last_look, asked.memory.time,
        asked.hours, asked.rates.home, asked.rates.own,
    )  # fmt: skip


def fill_stays(out: np.ndarray, question: Question) -> None:
    """How long the object stays at the place, and whether it is there by that alone."""
    asked, counts = question, question.counts
    sighting_columns_kernel.fill_stays(
        out, asked.is_place, counts.num_true, counts.last_true, counts.num_left, counts.time_true,
        counts.num_known, counts.last_known, counts.is_true, asked.looks, asked.last_look,
        asked.goes, asked.num_places, asked.memory.time, asked.hours, asked.rates.left,
    )  # fmt: skip


def fill_prior(out: np.ndarray, question: Question) -> None:
    """The prior, and posteriors that trust it as so many looks."""
    asked, memory = question, question.memory
    place_columns_kernel.fill_prior(
        out, asked.is_place, asked.counts.num_true, asked.looks, asked.expected.share,
        asked.expected.trust, memory.place_prior.crowding, asked.queries.home, asked.room,
        memory.room_label.shape[1], asked.last, asked.num_places,
    )  # fmt: skip


def fill_words(out: np.ndarray, question: Question) -> None:
    """Where things of such names are kept by the prior and in this home, and the place's own."""
    asked, expected = question, question.expected
    place_columns_kernel.fill_words(
        out, asked.is_place, expected.by_name, expected.name_cosine, asked.similar,
        expected.furniture_cosine, asked.num_places,
    )  # fmt: skip


def fill_filters(out: np.ndarray, question: Question) -> None:
    """What the adaptive filters believe."""
    place_columns_kernel.fill_filters(
        out, question.is_place, question.belief, ASKED, question.num_places
    )


def fill_places(out: np.ndarray, question: Question) -> None:
    """How much the place is used, and how often objects go there from where this one was."""
    asked, home = question, question.queries.home
    moves, last = asked.memory.history.moves, np.maximum(asked.last, 0)
    place_columns_kernel.fill_places(
        out, asked.is_place, asked.popularity, asked.sums.arrivals[home], moves[home, last],
        moves[home, :, last], asked.num_known, asked.num_seen, asked.num_places,
    )  # fmt: skip


def fill_others(out: np.ndarray, question: Question) -> None:
    """Where things of the same name, its companions, and what is out of its place were seen."""
    asked = question
    place_columns_kernel.fill_others(
        out, asked.is_place, asked.counts.num_true, asked.looks, asked.same, asked.fresh,
        asked.often, asked.strays, asked.memory.furniture_label, asked.room, asked.queries.home,
    )  # fmt: skip


def fill_rooms(out: np.ndarray, question: Question) -> None:
    """The room of the place."""
    asked = question
    place_columns_kernel.fill_rooms(
        out, asked.is_place, asked.counts.num_true, asked.num_seen, asked.room,
        asked.memory.room_label.shape[1], asked.last,
    )  # fmt: skip


def fill_hours(out: np.ndarray, question: Question) -> None:
    """Where the object was seen at this hour of the day, and where others that are out of place.

    All is 0 where the time is unknown.
    """
    asked, counts, memory = question, question.counts, question.memory
    if counts.hours is None:  # in none of the homes
        return
    home = asked.queries.home
    wide, narrow = (weigh_hour(memory, home, width) for width in (3.0, 8.0))
    sighting_columns_kernel.fill_hours(
        out, asked.is_place, counts.num_true, counts.num_known, counts.hours, wide, narrow,
        ~np.isnan(compute_hour(memory, home)), asked.strays_at_hour, asked.num_places,
    )  # fmt: skip


PLACE_GROUPS: Mapping[str, Callable[[np.ndarray, Question], None]] = {
    "sightings": fill_sightings,
    "looks": fill_looks,
    "times": fill_times,
    "stays": fill_stays,
    "prior": fill_prior,
    "words": fill_words,
    "filters": fill_filters,
    "places": fill_places,
    "others": fill_others,
    "rooms": fill_rooms,
    "hours": fill_hours,
}

"""What the memory says about a question as a whole: the home, its prior, the object asked for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.evidence import question_columns_kernel as kernels
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED, weigh_hour
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.question import ASKED, Question

_RIGHT = ("num_last_right", "num_common_right", "num_prior_right")


def fill_question_features(out: Mapping[str, np.ndarray], asked: Question) -> None:
    """Fill the columns of every group, float32 (Q, columns of the group).

    `movement.any_moved` is zero where what has just moved is not asked for more often than other
    things.
    """
    memory, counts, expected, rates = asked.memory, asked.counts, asked.expected, asked.rates
    sums, home, counters, now = asked.sums, asked.queries.home, memory.history.counters, memory.time
    objects, row = memory.objects, asked.queries.object
    num_asked = counters["num_asked"][home]
    if asked.queries.more_asked is not None:
        num_asked = num_asked + asked.queries.more_asked
    kernels.fill_size(
        out["size"], asked.num_places, memory.home_num_rooms[home], asked.num_known,
        sums.sightings[home], now, asked.hours,
    )  # fmt: skip
    kernels.fill_movement(
        out["movement"], asked.num_seen, objects["last_observed"][row], objects["num_moved"][row],
        now, asked.hours, rates.home, rates.own,
        rates.any_moved * (asked.asks_moved / TASKS_ASK_MOVED), rates.crossing,
        sums.arrivals.sum(axis=1)[home], rates.miss,
    )  # fmt: skip
    kernels.fill_stays(
        out["stays"], asked.num_seen, counts.num_true, counts.num_known, counts.num_left,
        objects["last_observed"][row], objects["num_sought"][row], objects["num_still"][row], now,
        asked.hours, rates.home_left, rates.left,
    )  # fmt: skip
    kernels.fill_trust(
        out["trust"], expected.trust, sums.num_typed[home], asked.num_known, sums.num_placed[home],
        sums.lift[home], num_asked, counters["num_found"][home],
        tuple(counters[name][home] for name in _RIGHT),
    )  # fmt: skip
    kernels.fill_words(
        out["words"], expected.trust, expected.name_cosine, expected.by_name, asked.similar,
        asked.most_similar,
    )  # fmt: skip
    kernels.fill_object(
        out["object"], asked.is_place, counts.num_true, asked.num_seen, counts.num_absent,
        expected.share, asked.same, asked.room, asked.last, asked.num_places, asked.belief, ASKED,
    )  # fmt: skip
    if counts.hours is None:  # in none of the homes
        out["hour"][:] = 0
        return
    kernels.fill_hour(
        out["hour"], counts.num_true, asked.num_seen, counts.hours, weigh_hour(memory, home, 8.0),
        compute_hour(memory, home), asked.last,
    )  # fmt: skip

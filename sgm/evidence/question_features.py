"""What the memory says about a question as a whole: the home, its prior, the object asked for.

Each function fills a group: `out` is float32 (Q, columns of the group).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sgm.evidence import question_columns_kernel
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED, weigh_hour
from sgm.evidence.object_counts import compute_hour
from sgm.evidence.place_features import ASKED
from sgm.evidence.question import Question


def fill_size(out: np.ndarray, question: Question) -> None:
    """How large the home is, and how much of it is known."""
    asked, home = question, question.queries.home
    question_columns_kernel.fill_size(
        out, asked.num_places, asked.memory.home_num_rooms[home], asked.num_known,
        asked.sums.sightings[home], asked.memory.time, asked.hours,
    )  # fmt: skip


def fill_movement(out: np.ndarray, question: Question) -> None:
    """How fast things move here, and how much this one may have moved since it was seen.

    `any_moved` is zero where what has just moved is not asked for more often than other things.
    """
    asked, objects, rates = question, question.memory.objects, question.rates
    row = asked.queries.object
    question_columns_kernel.fill_movement(
        out, asked.num_seen, objects["last_observed"][row], objects["num_moved"][row],
        asked.memory.time, asked.hours, rates.home, rates.own,
        rates.any_moved * (asked.asks_moved / TASKS_ASK_MOVED), rates.crossing,
        asked.sums.arrivals.sum(axis=1)[asked.queries.home], rates.miss,
    )  # fmt: skip


def fill_stays(out: np.ndarray, question: Question) -> None:
    """How long things stay here, and this one; how often it was gone when it was asked for."""
    asked, objects, counts = question, question.memory.objects, question.counts
    row = asked.queries.object
    question_columns_kernel.fill_stays(
        out, asked.num_seen, counts.num_true, counts.num_known, counts.num_left,
        objects["last_observed"][row], objects["num_sought"][row], objects["num_still"][row],
        asked.memory.time, asked.hours, asked.rates.home_left, asked.rates.left,
    )  # fmt: skip


def fill_trust(out: np.ndarray, question: Question) -> None:
    """How well simple rules and the prior have done in this home."""
    asked, sums, home = question, question.sums, question.queries.home
    counters, more_asked = asked.memory.history.counters, asked.queries.more_asked
    num_asked = counters["num_asked"][home] + (0 if more_asked is None else more_asked)
    rights = ("num_last_right", "num_common_right", "num_prior_right")
    question_columns_kernel.fill_trust(
        out, asked.expected.trust, sums.num_typed[home], asked.num_known, sums.num_placed[home],
        sums.lift[home], num_asked, counters["num_found"][home],
        tuple(counters[name][home] for name in rights),
    )  # fmt: skip


def fill_words(out: np.ndarray, question: Question) -> None:
    """Whether the prior knows the object, and how sure its name tells where it is kept."""
    expected = question.expected
    question_columns_kernel.fill_words(
        out, expected.trust, expected.name_cosine, expected.by_name, question.similar,
        question.most_similar,
    )  # fmt: skip


def fill_object(out: np.ndarray, question: Question) -> None:
    """Where the object tends to be, how sure that is, and what filters say in sum."""
    asked, counts = question, question.counts
    question_columns_kernel.fill_object(
        out, asked.is_place, counts.num_true, asked.num_seen, counts.num_absent,
        asked.expected.share, asked.same, asked.room, asked.last, asked.num_places, asked.belief,
        ASKED,
    )  # fmt: skip


def fill_hour(out: np.ndarray, question: Question) -> None:
    """What time it is, and how often the object is away from its usual place at that time."""
    asked, counts, memory = question, question.counts, question.memory
    if counts.hours is None:  # in none of the homes
        out[:] = 0
        return
    home = asked.queries.home
    question_columns_kernel.fill_hour(
        out, counts.num_true, asked.num_seen, counts.hours, weigh_hour(memory, home, 8.0),
        compute_hour(memory, home), asked.last,
    )  # fmt: skip


QUESTION_GROUPS: Mapping[str, Callable[[np.ndarray, Question], None]] = {
    "size": fill_size,
    "movement": fill_movement,
    "stays": fill_stays,
    "trust": fill_trust,
    "words": fill_words,
    "object": fill_object,
    "hour": fill_hour,
}

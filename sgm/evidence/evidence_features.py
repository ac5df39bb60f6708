"""The features of an answer: what a memory says about each place and about the question.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sgm.evidence import (
    away_from_home,
    copies,
    expected_columns,
    home_columns,
    lately_columns,
    onward_moves,
    question_columns,
    sighting_columns,
)
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.columns import PLACE_GROUP_COLUMNS, QUESTION_GROUP_COLUMNS
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

# What computes the columns of each group of `sgm.evidence.columns`, by name: (Q, F) each, whatever
# it is where a home has no place, or (Q,). All are zero of a group that returns none.
ComputeColumns = Callable[[Question], Mapping[str, np.ndarray]]
PLACE_GROUPS: Mapping[str, ComputeColumns] = {
    "sightings": sighting_columns.compute_sightings,
    "looks": sighting_columns.compute_looks,
    "times": sighting_columns.compute_times,
    "stays": sighting_columns.compute_stays,
    "prior": expected_columns.compute_prior,
    "words": expected_columns.compute_words,
    "filters": expected_columns.compute_filters,
    "places": home_columns.compute_places,
    "others": home_columns.compute_others,
    "ways": onward_moves.compute_ways,
    "lately": lately_columns.compute_at_places,
    "rooms": home_columns.compute_rooms,
    "hours": sighting_columns.compute_hours,
}
QUESTION_GROUPS: Mapping[str, ComputeColumns] = {
    "size": question_columns.compute_size,
    "movement": question_columns.compute_movement,
    "stays": question_columns.compute_stays,
    "trust": question_columns.compute_trust,
    "words": question_columns.compute_words,
    "object": question_columns.compute_object,
    "lately": lately_columns.compute_in_home,
    "elsewhere": away_from_home.compute_absence,
    "copies": copies.compute_copies,
    "hour": question_columns.compute_hour,
    "week": away_from_home.compute_week,
}


@dataclass(frozen=True, slots=True)
class Features:
    """What a memory says about Q questions, see `sgm.evidence.columns`.

    Attributes:
        place: float32 (Q, F, D).
        question: float32 (Q, C).
        asked: what they were computed of.
    """

    place: np.ndarray
    question: np.ndarray
    asked: Question

    @property
    def is_place(self) -> np.ndarray:
        """Which columns are furniture, bool (Q, F)."""
        return self.asked.arrays.is_place


def compute_features(
    memory: MemoryBatch, queries: Queries, asks_moved: float = TASKS_ASK_MOVED
) -> Features:
    """Compute the features of questions to memories, a home by itself or many at once.

    `asks_moved` is the share of the questions that are about what has just moved: the filters that
    reckon with it, and `movement.any_moved`, say which kind of question it is.
    """
    asked = Question.gather(memory, queries, asks_moved)
    is_place = asked.arrays.is_place
    place = _compute(PLACE_GROUPS, PLACE_GROUP_COLUMNS, asked, is_place.shape)
    place[:, ~is_place] = 0
    question = _compute(QUESTION_GROUPS, QUESTION_GROUP_COLUMNS, asked, is_place.shape[:1])
    return Features(
        np.ascontiguousarray(place.transpose(1, 2, 0)), np.ascontiguousarray(question.T), asked
    )


def _compute(
    groups: Mapping[str, ComputeColumns],
    names: Mapping[str, Sequence[str]],
    asked: Question,
    shape: tuple[int, ...],
) -> np.ndarray:
    """Return the columns of all groups, in the order of their names, float32 (D, *shape)."""
    nothing = np.zeros(shape)
    computed: list[np.ndarray] = []
    with np.errstate(divide="ignore", invalid="ignore"):  # where a home has no place
        for group, of_group in names.items():
            columns = groups[group](asked)
            computed += (
                [columns[name] for name in of_group] if columns else [nothing] * len(of_group)
            )
    joined = np.concatenate(computed, dtype=np.float32, casting="unsafe")
    return joined.reshape(-1, *shape)

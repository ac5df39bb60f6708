"""The features of an answer: what a memory says about each place and about the question.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sgm.evidence import (
    expected_columns,
    home_columns,
    question_columns,
    sighting_columns,
)
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

# What computes the columns of each group of `sgm.evidence.columns`, by name: (Q, F) each, whatever
# it is where a home has no place, or (Q,). What a group leaves out is zero.
PLACE_GROUPS: Mapping[str, Callable[[Question], Mapping[str, np.ndarray]]] = {
    "sightings": sighting_columns.compute_sightings,
    "looks": sighting_columns.compute_looks,
    "times": sighting_columns.compute_times,
    "stays": sighting_columns.compute_stays,
    "prior": expected_columns.compute_prior,
    "words": expected_columns.compute_words,
    "filters": expected_columns.compute_filters,
    "places": home_columns.compute_places,
    "others": home_columns.compute_others,
    "rooms": home_columns.compute_rooms,
    "hours": sighting_columns.compute_hours,
}
QUESTION_GROUPS: Mapping[str, Callable[[Question], Mapping[str, np.ndarray]]] = {
    "size": question_columns.compute_size,
    "movement": question_columns.compute_movement,
    "stays": question_columns.compute_stays,
    "trust": question_columns.compute_trust,
    "words": question_columns.compute_words,
    "object": question_columns.compute_object,
    "hour": question_columns.compute_hour,
}
_PLACE_NUMBER = {name: number for number, name in enumerate(PLACE_COLUMNS)}
_QUESTION_NUMBER = {name: number for number, name in enumerate(QUESTION_COLUMNS)}


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
    shape = asked.arrays.is_place.shape
    place = np.zeros((*shape, len(PLACE_COLUMNS)), dtype=np.float32)
    question = np.zeros((shape[0], len(QUESTION_COLUMNS)), dtype=np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):  # where a home has no place
        for group, compute in PLACE_GROUPS.items():
            for name, column in compute(asked).items():
                place[..., _PLACE_NUMBER[f"{group}.{name}"]] = column
    place[~asked.arrays.is_place] = 0
    for group, compute in QUESTION_GROUPS.items():
        for name, column in compute(asked).items():
            question[:, _QUESTION_NUMBER[f"{group}.{name}"]] = column
    return Features(place, question, asked)

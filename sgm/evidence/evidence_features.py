"""The features of an answer: what a memory says about each place and about the question.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sgm.evidence.adaptive_filter import (
    FILTERS,
    TASKS_ASK_MOVED,
    Rates,
    compute_beliefs,
    compute_filters,
    list_filters,
)
from sgm.evidence.columns import PLACE_GROUP_COLUMNS, QUESTION_GROUP_COLUMNS
from sgm.evidence.companions import Companions, compute_others, compute_words
from sgm.evidence.elsewhere import compute_absence, compute_week
from sgm.evidence.expected_places import (
    Expected,
    compute_destinations,
    compute_prior,
    compute_trust,
)
from sgm.evidence.home_columns import (
    compute_copies,
    compute_lately,
    compute_places,
    compute_rooms,
    compute_size,
    compute_ways,
)
from sgm.evidence.question import Question
from sgm.evidence.sighting_columns import (
    compute_hours,
    compute_looks,
    compute_movement,
    compute_object,
    compute_sightings,
    compute_stays,
    compute_times,
)
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

Columns = Mapping[str, np.ndarray]  # of one group, by name
Groups = Mapping[str, Columns]


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


def compute_features(
    memory: MemoryBatch, queries: Queries, asks_moved: float = TASKS_ASK_MOVED
) -> Features:
    """Compute the features of questions to memories, a home by itself or many at once.

    `asks_moved` is the share of the questions that are about what has just moved: the filters that
    reckon with it, and `movement.any_moved`, say which kind of question it is.
    """
    asked, of_places, of_question = compute_groups(memory, queries, asks_moved)
    place = _join(of_places, PLACE_GROUP_COLUMNS, asked.is_place.shape)
    place[:, ~asked.is_place] = 0
    question = _join(of_question, QUESTION_GROUP_COLUMNS, asked.home.shape)
    return Features(
        np.ascontiguousarray(place.transpose(1, 2, 0)), np.ascontiguousarray(question.T), asked
    )


def compute_groups(
    memory: MemoryBatch, queries: Queries, asks_moved: float
) -> tuple[Question, Groups, Groups]:
    """Compute the groups of `sgm.evidence.columns`, each after what it is made of.

    Columns of places are (Q, F), whatever they are where a home has no place; those of the
    question (Q,). All are zero of a group that has none.
    """
    asked = Question.gather(memory, queries)
    place: dict[str, Columns] = {}
    question: dict[str, Columns] = {}
    with np.errstate(divide="ignore", invalid="ignore"):  # where a home has no place
        expected = Expected.by_words(asked)
        goes = compute_destinations(asked, expected)
        question["trust"] = compute_trust(asked, expected)
        place["prior"] = compute_prior(asked, expected)
        rates = Rates.estimate(asked)
        beliefs = compute_beliefs(asked, rates, goes, list_filters(asks_moved))
        belief_of = dict(zip(FILTERS, np.moveaxis(beliefs, 1, 0), strict=True))
        place["filters"] = compute_filters(asked, belief_of)
        companions = Companions.gather(asked, rates.home * asked.hours)
        place["words"], question["words"] = compute_words(asked, expected, companions)
        place["others"] = compute_others(asked, companions)
        question["size"] = compute_size(asked)
        question["copies"] = compute_copies(asked)
        place["places"] = compute_places(asked)
        place["lately"], question["lately"] = compute_lately(asked, asks_moved)
        place["ways"] = compute_ways(asked, companions.likeness)
        place["rooms"] = compute_rooms(asked)
        place["looks"] = compute_looks(asked)
        place["times"] = compute_times(asked, rates)
        question["movement"] = compute_movement(asked, rates, asks_moved)
        place["sightings"] = compute_sightings(asked)
        place["stays"], question["stays"] = compute_stays(asked, rates, goes)
        question["object"] = compute_object(asked, expected, companions, belief_of)
        place["hours"], question["hour"] = compute_hours(asked)
        question["week"] = compute_week(asked)
        question["elsewhere"] = compute_absence(asked, rates, goes, belief_of)
    return asked, place, question


def _join(groups: Groups, names: Mapping[str, Sequence[str]], shape: tuple[int, ...]) -> np.ndarray:
    """Return the columns of all groups, in the order of their names, float32 (D, *shape)."""
    nothing = np.zeros(shape)
    columns: list[np.ndarray] = []
    for group, of_group in names.items():
        found = groups[group]
        columns += map(found.__getitem__, of_group) if found else [nothing] * len(of_group)
    joined = np.concatenate(columns, dtype=np.float32, casting="unsafe")
    return joined.reshape(-1, *shape)

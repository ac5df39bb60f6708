"""The features of an answer: what a memory says about each place and about the question.

Shares, ranks and 1 - exp(-rate x time) mean the same in a home of eight places and of sixty, and
where things move once an hour or once a month.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sgm.belief.corrections import CORRECTIONS
from sgm.evidence import (
    expected_columns,
    home_columns,
    question_columns,
    sighting_columns,
)
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED, follow_prior, trust_prior
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.evidence.expected_places import Expected
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_LEAST = 1e-6  # of a belief

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
_LIFT = _QUESTION_NUMBER["trust.prior_lift"]


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

    def follow_prior(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how far to trust the prior, (Q,), and the belief of its filter, (Q, F).

        No feature but a second opinion: `follow_prior`, up to half of it `trust_prior`. The memory
        must be as it was when the features were computed.
        """
        asked, trust = self.asked, self._compute_trust()
        prior = Expected.by_prior(asked.memory, asked.queries)
        belief = follow_prior(asked.memory, asked.queries, asked.rates, prior, asked.asks_moved)
        if trust.any():
            trusting = trust_prior(
                asked.memory, asked.queries, asked.rates, prior, asked.counts, asked.asks_moved
            )
            belief += CORRECTIONS.prior_second * trust[:, None] * (trusting - belief)
        return trust, belief

    def compare_asked(self) -> np.ndarray:
        """Return how much likelier each place is if anything may be asked for, (Q, F).

        In logarithms, beside half of the questions being about what has just moved, as in the tasks
        (docs/design.md, ruling 9), by the adaptive filter of the home's own rates.
        """
        learnt, asked = (self.asked.get_belief(name) + _LEAST for name in ("learnt", "asked"))
        return np.log(learnt / asked)

    def _compute_trust(self) -> np.ndarray:
        """Return how far the prior is to be trusted in this home about each thing, 0 to 1, (Q,).

        0 where it gives the places at which things were seen up to 1.5 nats more than an even guess
        does, on average, or up to half of what one does that is sure of them; 1 from 2 nats and six
        tenths on, and of a thing that was seen twenty times half as much.
        """
        lift = self.question[:, _LIFT].astype(float)
        share = lift / np.log(np.maximum(self.asked.arrays.num_places, 2))
        one = CORRECTIONS
        by_lift = (lift - one.lift_from) / (one.lift_to - one.lift_from)
        by_share = (share - one.known_from) / (one.known_to - one.known_from)
        own = one.own_sightings / (one.own_sightings + self.asked.arrays.num_seen)
        trust: np.ndarray = by_lift.clip(0, 1) * by_share.clip(0, 1) * own
        return trust


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

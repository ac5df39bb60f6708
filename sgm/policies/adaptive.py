"""A filter per object that knows no rules of the home and learns them from its own counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sgm.belief import Belief
from sgm.evidence.adaptive_filter import (
    TASKS_ASK_MOVED,
    FilterSettings,
    Rates,
    compute_beliefs,
)
from sgm.evidence.elsewhere import compute_elsewhere_of
from sgm.evidence.expected_places import Expected, compute_destinations
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.policy import Policy, mask_furniture, spread_unexpected


class Adaptive(Policy):
    """Believes what the counters of the memory say, with the prior as one sighting.

    How fast an object leaves, where it goes, whether it stays in its room and how often a look
    misses it are estimated from what was seen in this home. It keeps no state: a question follows
    the looks since the object was last seen (`compute_beliefs`).
    """

    def __init__(self, settings: FilterSettings | None = None) -> None:
        """Choose the filter; None for rates of the home's own, and half of all questions moved."""
        self._settings = settings or FilterSettings(asks_moved=TASKS_ASK_MOVED)

    def for_questions(self, asks_moved: float) -> Adaptive:
        """Return the same filter for such questions."""
        return type(self)(replace(self._settings, asks_moved=asks_moved))

    def reset(self, memory: MemoryBatch) -> None:
        """Ask the memory to count what the rates are estimated from."""
        memory.count_history()

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the probability of each furniture node, (Q, F)."""
        return mask_furniture(memory, queries, self.follow(memory, queries)[:, :-1])

    def believe(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Return where objects may be, (Q, F + 1): the places as the filter has them."""
        asked = Question.gather(memory, queries)
        rates = Rates.estimate(asked)
        places = self._follow(asked, rates)[:, :-1]
        places = spread_unexpected(places, asked.is_place)
        return Belief.of(places, compute_elsewhere_of(asked, rates))

    def follow(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the probability of each furniture node, and last of elsewhere, (Q, F + 1)."""
        asked = Question.gather(memory, queries)
        return self._follow(asked, Rates.estimate(asked))

    def _follow(self, asked: Question, rates: Rates) -> np.ndarray:
        goes = compute_destinations(asked, Expected.by_prior(asked), self._settings.hours)
        return compute_beliefs(asked, rates, goes, [self._settings])[:, 0]

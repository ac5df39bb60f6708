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
from sgm.policies.rhythm import load_weights, weigh_rhythm


class Adaptive(Policy):
    """Believes what the counters of the memory say, with the prior as one sighting.

    How fast an object leaves, where it goes, whether it stays in its room and how often a look
    misses it are estimated from what was seen in this home. It keeps no state: a question follows
    the looks since the object was last seen (`compute_beliefs`).
    """

    def __init__(self, settings: FilterSettings | None = None, *, uses_rhythm: bool = True) -> None:
        """Choose the filter; None for rates of the home's own, and half of all questions moved.

        `uses_rhythm` says whether similar moments are weighed beside it (`sgm.policies.rhythm`),
        where no question is about what has just moved.
        """
        self._settings = settings or FilterSettings(asks_moved=TASKS_ASK_MOVED)
        self._uses_rhythm = uses_rhythm

    def for_questions(self, asks_moved: float) -> Adaptive:
        """Return the same filter for such questions."""
        settings = replace(self._settings, asks_moved=asks_moved)
        return type(self)(settings, uses_rhythm=self._uses_rhythm)

    def reset(self, memory: MemoryBatch) -> None:
        """Ask the memory to count what the rates are estimated from."""
        memory.count_history()

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the probability of each furniture node, (Q, F)."""
        return mask_furniture(memory, queries, self.follow(memory, queries)[:, :-1])

    def believe(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Return where objects may be, (Q, F + 1): by the filter, and the home's rhythm."""
        asked = Question.gather(memory, queries)
        rates = Rates.estimate(asked)
        places = self._follow(asked, rates)[:, :-1]
        places = spread_unexpected(places, asked.is_place)
        belief = Belief.of(places, compute_elsewhere_of(asked, rates))
        if not self._uses_rhythm or self._settings.asks_moved:
            return belief
        return weigh_rhythm(memory, queries, belief, load_weights("adaptive"))

    def follow(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the probability of each furniture node, and last of elsewhere, (Q, F + 1)."""
        asked = Question.gather(memory, queries)
        return self._follow(asked, Rates.estimate(asked))

    def _follow(self, asked: Question, rates: Rates) -> np.ndarray:
        goes = compute_destinations(asked, Expected.by_prior(asked), self._settings.hours)
        return compute_beliefs(asked, rates, goes, [self._settings])[:, 0]

"""The contract between a task and the policy that answers it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Literal

import numpy as np

from sgm.arrays.grouped import sum_rows
from sgm.belief.corrections import CORRECTIONS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.messages import shorten

ScoreKind = Literal["weights", "logits"]


class Policy(ABC):
    """Answers where queried objects are, from the memory alone.

    A task cannot tell a heuristic from a network: it calls `reset` once per batch of homes,
    `scores` for every query and `observe` after every look. Only oracles reach the true homes.

    Attributes:
        score_kind: what its scores mean as probabilities, see `compute_probabilities`.
        looks_counted: how much of what negative looks of earlier time steps say is in its
            scores already, by which a finder counts them less where the object was ever seen: 0
            nothing, 1 all of it, as in a Bayes filter. Who reads the counters of the memory has
            half of it: measured (results/notes.md).
        answers_apart: whether an answer is the same to the bit whatever else is asked at once, in
            one pass that takes less time than several: a finder then has more things judged than
            the one that is asked for.
        needs: what it must know of the true homes (`HomeSource.knows`); empty for all but oracles.
    """

    score_kind: ClassVar[ScoreKind] = "weights"
    looks_counted: ClassVar[float] = CORRECTIONS.looks_counted
    answers_apart: ClassVar[bool] = False
    needs: ClassVar[frozenset[str]] = frozenset()

    @classmethod
    def make(cls, homes: Any) -> Policy:
        """Make the policy for the homes of a simulator; it may keep of them what it `needs`."""
        return cls()

    @classmethod
    def load(cls, source: str) -> Policy:
        """Load a policy that was made before, such as a trained network, from where it lies.

        Raises:
            ValueError: if there is none, or policies of this class are not loaded.
        """
        raise cls._make_not_loaded(source)

    @classmethod
    def identify(cls, source: str) -> str:
        """Return the checksum of what `load` reads there.

        Raises:
            ValueError: as `load` does.
        """
        raise cls._make_not_loaded(source)

    @classmethod
    def _make_not_loaded(cls, source: str) -> ValueError:
        return ValueError(
            f"policy must be one that is loaded to be followed by =, got {cls.__name__}="
            f"{shorten(source)}. Leave out what follows the name."
        )

    def play_in(self, homes: Any) -> Policy:
        """Return the same policy for some homes; a loaded one may have to know their rules."""
        return self

    def for_questions(self, asks_moved: float) -> Policy:
        """Return the policy for questions of another kind than those of the tasks.

        Where a share of what is asked for has just moved (`asks_moved`), half of the questions in
        the tasks (docs/design.md, ruling 9), the last sighting says less. Most policies do not
        reckon with that and answer all alike.
        """
        return self

    def reset(self, memory: MemoryBatch) -> None:  # noqa: B027 - most policies keep no state
        """Forget earlier homes; `memory` is that of the new ones.

        A policy that reads `MemoryBatch.history` asks for it here: `memory.count_history()`.
        """

    @abstractmethod
    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Score every furniture node for every query, (Q, F).

        -inf where there is no opinion, and in columns that are no furniture of the query's home
        (`MemoryBatch.is_furniture`). An answer depends on the home alone, not on who shares the
        batch with it.
        """

    def observe(self, memory: MemoryBatch, change: Change) -> None:  # noqa: B027
        """Take note of a look that the memory has just folded in."""


def mask_furniture(memory: MemoryBatch, queries: Queries, scores: np.ndarray) -> np.ndarray:
    """Return scores (Q, F) with -inf in columns that are no furniture of the query's home."""
    return np.where(memory.is_furniture[queries.home], scores, -np.inf)


def spread_over_furniture(
    memory: MemoryBatch,
    queries: Queries,
    compute_values: Callable[[np.ndarray], np.ndarray],
    default: np.ndarray,
) -> np.ndarray:
    """Take per-edge values of the query objects to places, (Q, F, 2).

    `compute_values` gets rows of `memory.edges`, (n,), and returns their values, (n,); places
    without a remembered edge have those of `default`, (Q, F, 2).
    """
    values = default.copy()
    query, edge = memory.edges_of(queries)
    place = (query, memory.edges["furniture"][edge], memory.edges["relation"][edge])
    values[place] = compute_values(edge)
    return values


def compute_probabilities(
    scores: np.ndarray, kind: ScoreKind, is_furniture: np.ndarray | None = None
) -> np.ndarray:
    """Turn scores into probabilities of the places, (Q, F), each row summing to one.

    The one place that says what the scores of a policy (`Policy.score_kind`) mean as probabilities:

    - "weights" (heuristics, filters, oracles): in proportion to the scores, negative ones and
      -inf as 0;
    - "logits" (networks): softmax over the places, -inf as 0. The loss weighs true and false
      edges alike, which multiplies every edge's odds by the same factor; the softmax divides it
      out again.

    A row without any mass is spread evenly over all furniture, as its choice is: the columns where
    `is_furniture`, bool (Q, F), says so, all of them if it is None.
    """
    if kind == "logits":
        best = scores.max(axis=1, keepdims=True)
        weights = np.exp(scores - np.where(np.isfinite(best), best, 0.0))
    else:
        weights = np.maximum(scores, 0.0)
    if is_furniture is None:
        is_furniture = np.ones(scores.shape, dtype=bool)
    count = is_furniture.sum(axis=1)
    total = sum_rows(weights, count)[:, None]
    even = is_furniture / count[:, None]
    return np.divide(weights, total, out=even, where=total > 0)

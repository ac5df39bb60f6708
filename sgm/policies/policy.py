"""The contract between a task and the policy that answers it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Literal

import numpy as np

from sgm.arrays.grouped import sum_rows
from sgm.belief import Belief, Detector
from sgm.evidence.adaptive_filter import compute_move_rates
from sgm.evidence.elsewhere import compute_elsewhere
from sgm.evidence.question import compute_step_hours, list_look_times
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.messages import shorten
from sgm.schema import NEVER

ScoreKind = Literal["weights", "logits"]
UNEXPECTED = 0.05  # share of what is asked for that is anywhere, whatever a rule says


class Policy(ABC):
    """Answers where queried objects are, from the memory alone.

    A task cannot tell a heuristic from a network: it calls `reset` once per batch of homes,
    `scores` for every query and `observe` after every look. Only oracles reach the true homes.

    Attributes:
        score_kind: what its scores mean as probabilities, see `compute_probabilities`.
        counts_looks: whether what looks of earlier time steps did not show is in its scores
            already, as in a Bayes filter; else `believe` counts it.
        answers_apart: whether an answer is the same to the bit whatever else is asked at once, in
            one pass that takes less time than several: a finder then has more things judged than
            the one that is asked for.
        needs: what it must know of the true homes (`HomeSource.knows`); empty for all but oracles.
    """

    score_kind: ClassVar[ScoreKind] = "weights"
    counts_looks: ClassVar[bool] = False
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

    def believe(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Return where the objects asked for may be: at each place, or elsewhere, (Q, F + 1).

        What a finder asks. `UNEXPECTED` of what a rule says is spread over all places, as it is not
        sure. Unless it `counts_looks`, what looks did not show follows by Bayes' rule
        (`weigh_looks_since`). `compute_elsewhere` says how likely it is at no place. The memory
        counts its history.
        """
        is_furniture = memory.is_furniture[queries.home]
        places = compute_probabilities(self.scores(memory, queries), self.score_kind, is_furniture)
        is_place = memory.mark_places(queries)
        places = spread_unexpected(places, is_place)
        if not self.counts_looks:
            places = places * weigh_looks_since(memory, queries)
        return Belief.of(places, compute_elsewhere(memory, queries))

    def observe(self, memory: MemoryBatch, change: Change) -> None:  # noqa: B027
        """Take note of a look that the memory has just folded in."""


def spread_unexpected(places: np.ndarray, is_place: np.ndarray) -> np.ndarray:
    """Return what a rule says of the places, weights (Q, F), but for `UNEXPECTED`: that anywhere.

    `is_place` says which columns are asked about, bool (Q, F).
    """
    places = np.where(is_place, places, 0.0)
    even = is_place / is_place.sum(axis=1, keepdims=True)
    total = np.maximum(places.sum(axis=1, keepdims=True), 1e-12)
    spread: np.ndarray = (1 - UNEXPECTED) * places / total + UNEXPECTED * even
    return spread


def weigh_looks_since(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return the likelihood of the looks at each place since objects were last seen there, (Q, F).

    None of them showed it. One of some time ago says little, as the object may have come since, at
    its own rate of moves: 1 - (1 - miss rate) exp(-rate time). Where an object was ever seen, half
    of that is in the counters, which rules read. The miss rate is the usual one unless it is given:
    a count of its own is too low, as what is missed for long is often elsewhere when it is seen.
    """
    history, step_hours = memory.history, compute_step_hours(memory)
    home, thing = queries.home, queries.object
    hours = step_hours[home]
    _, rate = compute_move_rates(memory, history, home, thing, step_hours)
    look_times, number = list_look_times(memory, queries, history)
    times = look_times[number]  # (Q, F, L), -1 for none
    since = np.full(times.shape[:2], NEVER)
    edges, (query, edge) = memory.edges, memory.edges_of(queries)
    cell = query, edges["furniture"][edge]
    np.maximum.at(since, cell, edges["last_true"][edge])
    stay = np.exp(-(rate * hours)[:, None, None] * (memory.time - times))
    given = queries.miss_rate
    detection = 1 - (Detector().miss_rate if given is None else given)
    is_later = times > since[..., None]
    likelihood: np.ndarray = np.where(is_later, 1 - detection * stay, 1.0).prod(axis=2)
    # Later looks in the very step of the sighting, as long as they are the last ones.
    is_then = ~edges["is_true"][edge] & (edges["last_observed"][edge] == since[cell])
    is_then &= edges["last_true"][edge] == since[cell]
    if is_then.any():
        missed = np.zeros(since.shape)
        np.maximum.at(missed, cell, edges["num_absent"][edge] * is_then)
        ago = np.where(since == NEVER, 0, memory.time - since)
        likelihood *= (1 - detection * np.exp(-(rate * hours)[:, None] * ago)) ** missed
    return likelihood ** np.where(since == NEVER, 1.0, 0.5)


def mask_furniture(memory: MemoryBatch, queries: Queries, scores: np.ndarray) -> np.ndarray:
    """Return scores (Q, F) with -inf in columns that are no furniture of the query's home."""
    return np.where(memory.is_furniture[queries.home], scores, -np.inf)


def spread_over_furniture(
    memory: MemoryBatch,
    queries: Queries,
    compute_values: Callable[[np.ndarray], np.ndarray],
    default: np.ndarray,
) -> np.ndarray:
    """Take per-edge values of the query objects to places, (Q, F, relations).

    `compute_values` gets rows of `memory.edges`, (n,), and returns their values, (n,); places
    without a remembered edge have those of `default`, (Q, F, relations).
    """
    values = default.copy()
    query, edge = memory.edges_of(queries)
    place = (query, memory.edges["furniture"][edge], memory.edges["relation"][edge])
    values[place] = compute_values(edge)
    return values


def compute_probabilities(
    scores: np.ndarray, score_kind: ScoreKind, is_furniture: np.ndarray | None = None
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

    Raises:
        ValueError: if a score is nan or infinite, but for -inf.
    """
    if score_kind == "logits":
        best = scores.max(axis=1, keepdims=True)
        weights = np.exp(scores - np.where(np.isfinite(best), best, 0.0))
    else:
        weights = np.maximum(scores, 0.0)
    if is_furniture is None:
        is_furniture = np.ones(scores.shape, dtype=bool)
    count = is_furniture.sum(axis=1)
    total = sum_rows(weights, count)[:, None]
    if not np.isfinite(total).all():
        raise ValueError(
            "scores of a policy must be numbers, or -inf for what it rules out, got nan or "
            f"infinity for question {int(np.isfinite(total)[:, 0].argmin())}. Mend what the policy "
            "computes."
        )
    even = is_furniture / count[:, None]
    return np.divide(weights, total, out=even, where=total > 0)

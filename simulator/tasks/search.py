"""Searches: ask, score, choose an open place, look, remember, until the object is found."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from sgm.memory.queries import Queries
from simulator.tasks.answer import Answer
from simulator.tasks.rollout import Rollout, compute_answers
from simulator.world.sensing import Observation
from simulator.world.streams import sample_best


class SearchOrder(ABC):
    """Chooses the next place to look at from the policy's scores."""

    @abstractmethod
    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose one open furniture node for each home that searches, -1 to give up, (n,).

        Args:
            homes: homes that search, (n,).
            scores: the policy's, -inf where it has no opinion, (n, F).
            is_open: furniture not yet looked at in this search, bool (n, F); some in each row.
            uniform: a random number per home, to break ties with, (n,).
        """


class ByScore(SearchOrder):
    """The highest score first, ties at random; places without opinion come last."""

    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose the open furniture node of the highest score."""
        return sample_best(scores, is_open, uniform)


class Search:
    """One search in each of H homes; each goes on until it is over, whatever the others do.

    The homes stand still meanwhile. Every look enters the memory, and no place is offered twice:
    a second look at a place, by who chooses for himself, is counted and changes nothing, as is a
    look at a place that a home does not have.

    A search succeeds when the place looked at truly holds the object: the task knows, although the
    detector may miss the object there (docs/design.md, ruling 11). It ends without success after
    `max_looks` looks, where no place is left, or where the order gives up.

    Attributes:
        rollout: the homes, the memory and the policy that is asked.
        codes: description asked for, (H,).
        queries: the same for the memory, one query per home.
        answers: furniture that holds such an object, bool (H, F).
        is_open: furniture not yet looked at in this search, bool (H, F).
        is_found, gave_up: how the search ended, bool (H,).
        num_looks: looks so far, (H,).
        max_looks: looks allowed.
    """

    def __init__(
        self,
        rollout: Rollout,
        codes: np.ndarray,
        queries: Queries,
        max_looks: int | None = None,
        *,
        ends_when_seen: bool = False,
    ) -> None:
        """Begin to search; `Search(rollout, *rollout.ask())` for what a task would ask for.

        Args:
            rollout: the homes, the memory and the policy.
            codes: descriptions to search for, (H,); there need not be any such object.
            queries: from `rollout.query`, one per home.
            max_looks: None for as many as there is furniture.
            ends_when_seen: whether a search succeeds when the detector has seen the object, as it
                must be where the truth is unknown.
        """
        self.rollout = rollout
        self.codes = codes
        self.queries = queries
        self.answers = compute_answers(rollout.homes, codes)
        self.is_open = rollout.memory.is_furniture.copy()
        self.is_found = np.zeros(len(codes), dtype=bool)
        self.gave_up = np.zeros(len(codes), dtype=bool)
        self.num_looks = np.zeros(len(codes), dtype=np.int64)
        self.max_looks = rollout.memory.num_furniture if max_looks is None else max_looks
        self._ends_when_seen = ends_when_seen

    @property
    def is_over(self) -> np.ndarray:
        """Whether the search has ended, found or not, bool (H,)."""
        return self.is_found | self.gave_up | (self.num_looks >= self.max_looks)

    @property
    def homes(self) -> np.ndarray:
        """Homes that still search, ascending, (n,)."""
        return np.flatnonzero(~self.is_over)

    def scores(self, homes: np.ndarray | None = None) -> np.ndarray:
        """Ask the policy about some homes (n,), or all of them; (n, F)."""
        return self.rollout.score(self.queries if homes is None else self.queries.take(homes))

    def choose(self, order: SearchOrder) -> Answer:
        """Choose where every home that still searches looks next; n queries, one for each.

        A home without an open place gives up; the order is not asked about it.

        Raises:
            ValueError: if the order offers a place that is not open.
        """
        homes = self.homes
        scores = self.scores(homes)
        uniform = self.rollout.homes.streams.rows("search ties", 1).take(homes)[:, 0]
        rows = np.flatnonzero(self.is_open[homes].any(axis=1))
        chosen = order.choose(homes[rows], scores[rows], self.is_open[homes[rows]], uniform[rows])
        is_wrong = (chosen >= 0) & ~self.is_open[homes[rows], chosen]
        if is_wrong.any():
            raise ValueError(
                f"order must choose an open place, got furniture {chosen[is_wrong][0]} in home "
                f"{homes[rows][is_wrong][0]}. Choose one that is_open allows, or -1 to give up."
            )
        choice = np.full(len(homes), -1)
        choice[rows] = chosen
        return Answer(
            self.queries.take(homes),
            self.answers[homes],
            scores,
            choice,
            is_repeat=bool(self.num_looks.any()),
        )

    def look(self, homes: np.ndarray, furniture: np.ndarray) -> Observation:
        """Look once in some homes that still search, each once, (n,), and remember what is there.

        Furniture -1 is to give up. Returns what was seen, at places looked at for the first time.
        """
        self.gave_up[homes[furniture < 0]] = True
        homes, furniture = homes[furniture >= 0], furniture[furniture >= 0]
        self.num_looks[homes] += 1
        is_place = furniture < self.is_open.shape[1]
        homes, furniture = homes[is_place], furniture[is_place]
        is_new = self.is_open[homes, furniture]
        homes, furniture = homes[is_new], furniture[is_new]
        looked = np.full(len(self.codes), -1)
        looked[homes] = furniture
        seen = self.rollout.look(looked)
        self.is_open[homes, furniture] = False
        if self._ends_when_seen:
            self.is_found[seen.seen_home[seen.seen_code == self.codes[seen.seen_home]]] = True
        else:
            self.is_found[homes] = self.answers[homes, furniture]
        return seen

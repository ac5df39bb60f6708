"""Task "Find Object": look at one place after another until the object asked for is found."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simulator.memory.memory_batch import Queries
from simulator.policies import Policy
from simulator.tasks.predict_location import compute_answers
from simulator.tasks.rollout import Rollout
from simulator.world.homes import Homes
from simulator.world.streams import sample_categorical


@dataclass(frozen=True, slots=True)
class Episode:
    """One search in each of H homes.

    Attributes:
        codes: description asked for, (H,).
        answers: furniture that holds such an object, bool (H, F).
        is_found: whether one of the looks went to such furniture, bool (H,).
        num_looks: looks taken, (H,).
    """

    codes: np.ndarray
    answers: np.ndarray
    is_found: np.ndarray
    num_looks: np.ndarray


@dataclass(frozen=True, slots=True)
class Looks:
    """The n-th look of every home that is still searching.

    Attributes:
        homes: which homes, ascending, (n,).
        furniture: where each of them looks, (n,).
        scores: what the policy said about all furniture, (n, F).
        queries: what they look for, one query per home.
        answers: furniture that holds such an object, bool (n, F).
    """

    homes: np.ndarray
    furniture: np.ndarray
    scores: np.ndarray
    queries: Queries
    answers: np.ndarray


class SearchOrder(ABC):
    """Chooses the next place to look at from the policy's scores."""

    @abstractmethod
    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose one open furniture node per home.

        Args:
            homes: homes that search, (n,).
            scores: the policy's, -inf where it has no opinion, (n, F).
            is_open: furniture not yet looked at in this episode, bool (n, F); some in each row.
            uniform: a random number per home, to break ties with, (n,).

        Returns:
            (n,) furniture indices.
        """


class ByScore(SearchOrder):
    """The highest score first, ties at random; places without opinion come last."""

    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose the open furniture node of the highest score."""
        best = np.where(is_open, scores, -np.inf).max(axis=1, keepdims=True)
        return sample_categorical((is_open & (scores == best)).astype(float), uniform)


class FindObject:
    """Find Object, played by one policy in H homes in lockstep.

    Each episode evolves the homes by one step and asks for an object; then every home that has
    not found it looks again. Within an episode the home is static, every look updates the
    memory, and no place is offered twice. The memory lives on from episode to episode.

    A search ends when the place looked at truly holds the object: the task knows, although the
    agent's detector may miss the object there (docs/design.md, ruling 11). The metric is the
    number of looks,
    and `max_looks + 1` for what was not found.

    Attributes:
        rollout: the homes, the memory and the policy.
        max_looks: looks allowed per episode.
        on_look: called with every batch of looks before it enters the memory.

    Source: paper section 5.2 and appendix F ("if the agent correctly predicts the
    furniture
    object on which the object is placed, we count the event as a success");
    docs/design.md, ruling 18.
    """

    def __init__(
        self,
        homes: Homes,
        policy: Policy,
        max_looks: int | None = None,
        order: SearchOrder | None = None,
    ) -> None:
        """Start at t = 0 with an empty memory.

        Args:
            homes: the true homes.
            policy: scores the furniture before every look.
            max_looks: looks allowed per episode; None to look everywhere.
            order: turns scores into the next place; highest score first if None.

        Raises:
            ValueError: if `max_looks` is below 1 or exceeds the number of furniture nodes.
        """
        if max_looks is None:
            max_looks = homes.num_furniture
        if not 1 <= max_looks <= homes.num_furniture:
            raise ValueError(
                f"max_looks must be at least 1 and at most the {homes.num_furniture} furniture "
                f"nodes of a home, got {max_looks}. No place is offered twice."
            )
        self.rollout = Rollout(homes, policy)
        self.max_looks = max_looks
        self.order = order or ByScore()
        self.on_look: Callable[[Looks], None] = lambda looks: None

    def run(self, num_episodes: int) -> Iterator[Episode]:
        """Play episodes; each is yielded when its last search has ended."""
        for _ in range(num_episodes):
            yield self._search()

    def _search(self) -> Episode:
        homes = self.rollout.homes
        codes, queries = self.rollout.ask()
        answers = compute_answers(homes, codes)
        is_open = np.ones(answers.shape, dtype=bool)
        is_found = np.zeros(homes.num_homes, dtype=bool)
        num_looks = np.zeros(homes.num_homes, dtype=np.int64)
        for _ in range(self.max_looks):
            home = np.flatnonzero(~is_found)
            if len(home) == 0:
                break
            furniture = self._look(home, queries, answers, is_open)
            is_open[home, furniture] = False
            num_looks[home] += 1
            is_found[home] = answers[home, furniture]
        return Episode(codes, answers, is_found, num_looks)

    def _look(
        self, homes: np.ndarray, queries: Queries, answers: np.ndarray, is_open: np.ndarray
    ) -> np.ndarray:
        """Let the homes that still search look once more; return where, (n,)."""
        rollout = self.rollout
        asked = Queries(queries.home[homes], queries.object[homes], queries.prior[homes])
        scores = rollout.policy.scores(rollout.memory, asked)
        uniform = rollout.homes.streams.rows("search ties", 1).take(homes)[:, 0]
        furniture = self.order.choose(homes, scores, is_open[homes], uniform)
        self.on_look(Looks(homes, furniture, scores, asked, answers[homes]))
        looked = np.full(rollout.homes.num_homes, -1)
        looked[homes] = furniture
        rollout.look(looked)
        return furniture

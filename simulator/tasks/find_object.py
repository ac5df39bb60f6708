"""Task "Find Object": look at one place after another until the object asked for is found."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sgm.policies.policy import Policy
from simulator.tasks.search import ByScore, Search, SearchOrder
from simulator.tasks.task import Task
from simulator.world.homes import Homes


class FindObject(Task):
    """A home's score is the number of looks until the object is found.

    Each step evolves the homes and asks for an object; then every home that has not found it
    looks again. The memory lives on from search to search. What was not found counts as
    `max_looks + 1` looks.

    Source: paper section 5.2 and appendix F ("if the agent correctly predicts the furniture
    object on which the object is placed, we count the event as a success"); docs/design.md,
    ruling 18.
    """

    title = "Find Object"
    metric = "looks"

    def __init__(
        self,
        homes: Homes,
        policy: Policy,
        max_looks: int | None = None,
        order: SearchOrder | None = None,
    ) -> None:
        """Start at t = 0 with an empty memory.

        A search ends after `max_looks`, None for what the rules of the homes say; the order turns
        scores into the next place, None for the highest first.

        Raises:
            ValueError: if `max_looks` is below 1 or exceeds the number of furniture nodes.
        """
        if max_looks is None:
            bounds = [config.max_looks for config in homes.configs if config.max_looks is not None]
            max_looks = min([*bounds, homes.num_furniture])
        if not 1 <= max_looks <= homes.num_furniture:
            raise ValueError(
                f"max_looks must be at least 1 and at most the {homes.num_furniture} furniture "
                f"nodes of a home, got {max_looks}. No place is offered twice."
            )
        super().__init__(homes, policy)
        self.max_looks = max_looks
        self.order = order or ByScore()

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play searches; each gives the number of looks of every home, (H,)."""
        for search in self.search(num_steps):
            yield np.where(search.is_found, search.num_looks, self.max_looks + 1.0)

    def search(self, num_searches: int) -> Iterator[Search]:
        """Play searches; each is yielded when it is over in every home."""
        for _ in range(num_searches):
            search = Search(self.rollout, *self.rollout.ask(), self.max_looks)
            while len(search.homes):
                answer = search.choose(self.order)
                self.on_answer(answer)
                search.look(answer.queries.home, answer.choice)
            yield search

"""One search of Find Object after another, in homes that are stepped together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.spaces import Dict, Discrete

from simulator.gym.memory_graph import make_graph_space, make_graphs
from simulator.policies import Policy, make_policy
from simulator.priors.prior_graph import PriorGraph
from simulator.tasks.rollout import Rollout
from simulator.tasks.search import Search
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

MakeHomes = Callable[[Streams], Homes]


class SearchSeries:
    """One search after another in each of H homes; all homes start each search together.

    Attributes:
        rollout: the homes, the memory and the policy that watches.
        search: the search that goes on.
        num_searches: searches that these homes have seen, this one included.
    """

    rollout: Rollout
    search: Search

    def __init__(
        self,
        num_homes: int,
        make_homes: MakeHomes | None,
        policy: str | Callable[[Homes], Policy],
        max_looks: int | None,
        queries_per_home: int,
    ) -> None:
        """Set up; nothing is played before `start`.

        Args:
            num_homes: H.
            make_homes: makes the homes from their random streams, for example the method
                `make_homes` of recorded homes; None to sample them from the shipped prior.
            policy: who may be asked for scores: a name of `POLICIES`, or what makes one.
            max_looks: looks allowed per search; None for as many as there is furniture.
            queries_per_home: searches before new homes are drawn.

        Raises:
            ValueError: if a count is below 1, or there is no policy of that name.
        """
        for name, value in (
            ("num_envs", num_homes), ("max_looks", max_looks),
            ("queries_per_home", queries_per_home),
        ):  # fmt: skip
            if value is not None and value < 1:
                raise ValueError(f"{name} must be at least 1, got {value}. Raise it.")
        self._make_homes = _sample_homes if make_homes is None else make_homes
        self._policy = policy
        self._max_looks = max_looks
        self._queries_per_home = queries_per_home
        self._numbers = range(num_homes)
        self._draw(home_seed=0)  # for the sizes of the spaces; `start` draws the first homes
        self.num_searches = queries_per_home

    @property
    def needs_homes(self) -> bool:
        """Whether the next search is in new homes."""
        return self.num_searches >= self._queries_per_home

    @property
    def observation_space(self) -> Dict:
        """Space of the observation of one home."""
        num_codes = self.rollout.homes.object_descriptions.num_descriptions
        return Dict({"graph": make_graph_space(), "query": Discrete(num_codes)})

    def start(self, home_seed: int | None) -> None:
        """Let the homes evolve by one step and ask for an object in each.

        Args:
            home_seed: to draw new homes first; None to go on in the same.
        """
        if home_seed is not None:
            self._draw(home_seed)
        self.search = Search(self.rollout, *self.rollout.ask(), self._max_looks)
        self.num_searches += 1

    def observe(self) -> list[dict[str, Any]]:
        """Return the observation of every home."""
        graphs = make_graphs(self.rollout.memory, self.search.queries)
        return [
            {"graph": graph, "query": np.int64(code)}
            for graph, code in zip(graphs, self.search.codes, strict=True)
        ]

    def describe(self, home: int) -> str:
        """Spell out what is searched for in a home."""
        return self.rollout.homes.object_descriptions.text(int(self.search.codes[home]))

    def _draw(self, home_seed: int) -> None:
        homes = self._make_homes(Streams(home_seed, "train", self._numbers))
        make = self._policy
        policy = make_policy(make, homes) if isinstance(make, str) else make(homes)
        self.rollout = Rollout(homes, policy)
        self.num_searches = 0


def _sample_homes(streams: Streams) -> Homes:
    """Sample homes from the shipped prior."""
    return SampledHomes(PriorGraph.default(), HomeConfig(), streams)

"""One search of Find Object after another, in homes that are stepped together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.spaces import Dict, Discrete

from sgm.checks import check_at_least
from sgm.policies.policy import Policy
from simulator.gym.memory_graph import make_graph_space, make_graphs
from simulator.policies import make_policy
from simulator.tasks.rollout import Rollout
from simulator.tasks.search import Search
from simulator.world.homes import Homes
from simulator.world.source import Group, HomeSource, SampledSource
from simulator.world.streams import Streams


class SearchSeries:
    """One search after another in each of H homes; all homes start each search together.

    Attributes:
        rollout: the homes, the memory and the policy that watches.
        search: the search that goes on.
        num_searches: searches that these homes have seen, this one included.
        num_furniture: furniture nodes that a home may have, F; a smaller one has no place beyond
            its own.
    """

    rollout: Rollout
    search: Search
    _max_searches: int

    def __init__(
        self,
        num_homes: int,
        homes: HomeSource | None,
        policy: str | Callable[[Homes], Policy],
        max_looks: int | None,
        queries_per_home: int,
        max_furniture: int | None,
    ) -> None:
        """Set up; nothing is played before `start`. Arguments are those of `FindObjectEnv`.

        Raises:
            ValueError: if a count is below 1, there is no policy of that name, or there are not so
                many homes to be played in lockstep.
        """
        check_at_least(
            1,
            num_envs=num_homes,
            max_looks=max_looks,
            queries_per_home=queries_per_home,
            max_furniture=max_furniture,
        )
        self._source = SampledSource() if homes is None else homes
        self._policy = policy
        self._max_looks = max_looks
        self._queries_per_home = queries_per_home
        self._num_homes = num_homes
        self.num_furniture = max_furniture or 0
        self._draw(home_seed=0)  # for the sizes of the spaces; `start` draws the first homes
        self.num_furniture = max_furniture or self.rollout.homes.num_furniture
        self.num_searches = self._max_searches

    @property
    def observation_space(self) -> Dict:
        """Space of the observation of one home."""
        num_codes = self.rollout.homes.object_descriptions.num_descriptions
        return Dict({"graph": make_graph_space(), "query": Discrete(num_codes)})

    @property
    def action_mask(self) -> np.ndarray:
        """What was not yet looked at in this search, int8 (H, F)."""
        is_open = self.search.is_open
        mask = np.zeros((len(is_open), self.num_furniture), dtype=np.int8)
        mask[:, : is_open.shape[1]] = is_open
        return mask

    def start(self, rng: np.random.Generator, is_new: bool) -> None:
        """Let the homes evolve by one step, new ones if wanted or needed, and ask in each."""
        if is_new or self.num_searches >= self._max_searches:
            self._draw(int(rng.integers(2**31)))
        self.search = Search(self.rollout, *self.rollout.ask(), self._max_looks)
        self.num_searches += 1

    def observe(self) -> dict[str, Any]:
        """Return graph and query of every home, (H,) each."""
        graphs = make_graphs(self.rollout.memory, self.search.queries)
        return {"graph": tuple(graphs), "query": self.search.codes.astype(np.int64)}

    def compute_scores(self) -> np.ndarray:
        """Ask the policy about the objects searched for, (H, F)."""
        scores = self.search.scores()
        padding = ((0, 0), (0, self.num_furniture - scores.shape[1]))
        return np.pad(scores, padding, constant_values=-np.inf)

    def get_info(self) -> dict[str, np.ndarray]:
        """Return mask, what is searched for in words, whether it is found, and looks, (H, ...)."""
        return {
            "action_mask": self.action_mask,
            "query": np.array([self.describe(home) for home in range(self._num_homes)]),
            "is_found": self.search.is_found.copy(),
            "num_looks": self.search.num_looks.copy(),
        }

    def describe(self, home: int) -> str:
        """Spell out what is searched for in a home."""
        return self.rollout.homes.object_descriptions.text(int(self.search.codes[home]))

    def _draw(self, home_seed: int) -> None:
        group = self._choose_homes(home_seed)
        homes = self._source.make(Streams(home_seed, "train", group.homes))
        if self.num_furniture and homes.num_furniture > self.num_furniture:
            raise ValueError(
                f"max_furniture must be that of the largest home, got {self.num_furniture} and a "
                f"home of {homes.num_furniture}. Raise it."
            )
        make = self._policy
        policy = make_policy(make, homes) if isinstance(make, str) else make(homes)
        self.rollout = Rollout(homes, policy)
        self.num_searches = 0
        self._max_searches = min(self._queries_per_home, group.num_steps or self._queries_per_home)

    def _choose_homes(self, home_seed: int) -> Group:
        """Choose homes to draw: by chance, or the first ones where there is no end to them."""
        count = self._source.num_homes
        groups = self._source.list_groups(range(self._num_homes if count is None else count))
        groups = [group for group in groups if len(group.homes) >= self._num_homes]
        if not groups:
            raise ValueError(
                f"num_envs must be a number of homes that can be played in lockstep, got "
                f"{self._num_homes}. Lower it, or use vectorization_mode='sync'."
            )
        if count is None:
            return groups[0]
        rng = np.random.default_rng(home_seed)
        sizes = np.array([len(group.homes) for group in groups])
        group = groups[rng.choice(len(groups), p=sizes / sizes.sum())]
        homes = rng.choice(group.homes, self._num_homes, replace=False)
        return Group(tuple(homes.tolist()), group.num_steps)

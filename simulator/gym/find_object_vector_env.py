"""Find Object in many homes at once, as a native Gymnasium vector environment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from sgm.messages import shorten
from simulator.gym.search_series import SearchSeries
from simulator.policies import Policy
from simulator.world.homes import Homes
from simulator.world.source import HomeSource


class FindObjectVectorEnv(VectorEnv[dict[str, Any], np.ndarray, np.ndarray]):
    """H homes in lockstep: one `reset` starts a search in each, one `step` is a look in each.

    Time passes for all homes at once, so that searches start together: there is no autoreset. A
    home that has found its object waits, with reward 0 and `terminations` true, whatever its
    action; when all are over, call `reset`. Everything else is as in `FindObjectEnv`, and with
    the same seed home 0 of sampled ones is the home of that environment.

    Observation: `graph`, a tuple of H graphs, and `query`, (H,). Info: `action_mask`, int8 (H, F);
    `query`, texts (H,); `is_found`, bool (H,); `num_looks`, (H,).
    """

    metadata = {  # noqa: RUF012 - an instance variable in Gymnasium's typing
        "render_modes": [],
        "autoreset_mode": AutoresetMode.DISABLED,
    }

    def __init__(
        self,
        num_envs: int = 1,
        homes: HomeSource | None = None,
        policy: str | Callable[[Homes], Policy] = "bayesian",
        max_looks: int | None = None,
        queries_per_home: int = 100,
        max_furniture: int | None = None,
    ) -> None:
        """Set up the spaces for `num_envs` homes, H; other arguments are those of `FindObjectEnv`.

        Raises:
            ValueError: if a count is below 1, there is no policy of that name, or there are not so
                many homes.
        """
        self.num_envs = num_envs
        self.searches = SearchSeries(
            num_envs, homes, policy, max_looks, queries_per_home, max_furniture
        )
        self.labels: list[str] = self.searches.rollout.homes.labels
        self.single_observation_space = self.searches.observation_space
        self.single_action_space = Discrete(self.searches.num_furniture)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the next search in every home.

        Args:
            seed: to draw new homes, one number for all.
            options: `new_home` to draw new homes; `reset_mask`, if given, must be all true.

        Raises:
            ValueError: if only some homes are to be reset, or seeds come one by one.
        """
        options = options or {}
        if isinstance(seed, list):
            raise ValueError(
                f"seed must be one number for all homes, got {seed}. They differ by their number."
            )
        if not np.all(options.get("reset_mask", True)):
            raise ValueError(
                "homes must be reset together, got a reset_mask for some. Step until all searches "
                "are over, or use vectorization_mode='sync'."
            )
        super().reset(seed=seed)
        is_new = seed is not None or options.get("new_home") or self.searches.needs_homes
        self.searches.start(int(self.np_random.integers(2**31)) if is_new else None)
        return self._observe(), self._get_info()

    def step(
        self, actions: np.ndarray
    ) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Look at one furniture node in every home that is still searching, (H,).

        Raises:
            ValueError: if there is no such furniture.
        """
        actions = np.asarray(actions)
        num_furniture = self.searches.num_furniture
        is_shaped = actions.shape == (self.num_envs,)
        if not (is_shaped and ((actions >= 0) & (actions < num_furniture)).all()):
            raise ValueError(
                f"actions must be {self.num_envs} furniture indices from 0 to {num_furniture - 1}, "
                f"got {shorten(actions)}. Choose what info['action_mask'] allows."
            )
        search = self.searches.search
        rewards = -1.0 * ~search.is_over
        search.look(search.homes, actions[search.homes])
        is_found = search.is_found.copy()
        return self._observe(), rewards, is_found, search.is_over & ~is_found, self._get_info()

    def compute_scores(self) -> np.ndarray:
        """Ask the policy how likely each furniture node holds the object, (H, F)."""
        return self.searches.compute_scores()

    def _observe(self) -> dict[str, Any]:
        observations = self.searches.observe()
        return {
            "graph": tuple(observation["graph"] for observation in observations),
            "query": self.searches.search.codes.astype(np.int64),
        }

    def _get_info(self) -> dict[str, Any]:
        search = self.searches.search
        return {
            "action_mask": self.searches.action_mask,
            "query": np.array([self.searches.describe(home) for home in range(self.num_envs)]),
            "is_found": search.is_found.copy(),
            "num_looks": search.num_looks.copy(),
        }

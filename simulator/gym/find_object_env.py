"""Find Object as a Gymnasium environment, FindObject-v0: of one home, or of many at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from sgm.messages import shorten
from sgm.policies.policy import Policy, compute_probabilities
from simulator.gym.place_rows import PLACE_COLUMNS, compute_place_rows
from simulator.gym.reset_options import NEW_HOME, reads_new_home
from simulator.gym.search_series import SearchSeries
from simulator.world.homes import Homes
from simulator.world.source import HomeSource


class FindObjectEnv(gymnasium.Env[dict[str, Any], np.int64]):
    """Look at one furniture node after another until the object asked for is found.

    An episode is one search. Every reset lets the home evolve by one step and asks for another
    object; the memory lives on. A new home is drawn by `reset(seed=...)`, by
    `reset(options={"new_home": True})` and after `queries_per_home` searches.

    Action: index of the furniture node to look at. `info["action_mask"]` (int8, (F,)) has a 1 for
    what was not yet looked at in this search; a second look costs the same and changes nothing, as
    does a look at a place that a smaller home does not have.

    Observation:
        graph: what is remembered of the home, and the hypothetical edges of the query object;
            features are listed in `simulator.gym.memory_graph`. Furniture f is node 2 + R + f.
        query: number of the description asked for, as in the feature "description" of its node.

    Reward: -1 a look, so that the return is minus the metric of the task. An episode terminates
    when the object is found and is truncated after `max_looks` looks.

    Info: `action_mask`; `query`, the description in words; `is_found`; `num_looks`.

    Attributes:
        searches: the home, its memory and the search that goes on.
        labels: names of the numbers in the feature "label".
        num_furniture: furniture nodes, F.
        place_columns: names of what `compute_place_rows` returns.

    Source: paper section 5.2; docs/design.md, ruling 18.
    """

    place_columns = PLACE_COLUMNS
    metadata = {  # noqa: RUF012 - an instance variable in Gymnasium's typing
        "render_modes": ["rgb_array"],
        "render_fps": 2,
    }

    def __init__(
        self,
        homes: HomeSource | None = None,
        policy: str | Callable[[Homes], Policy] = "bayesian",
        max_looks: int | None = None,
        queries_per_home: int = 100,
        max_furniture: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Set up the spaces.

        Args:
            homes: where homes come from, such as recorded ones; None to sample them from the
                shipped prior.
            policy: who answers `compute_scores`: a name of `POLICIES`, or what makes one.
            max_looks: looks allowed per search; None for as many as there is furniture.
            queries_per_home: searches before a new home is drawn; fewer where a home was not
                recorded for so many steps.
            max_furniture: furniture nodes of the largest home, F; None if all are as large as the
                first.
            render_mode: "rgb_array" for pictures of what the policy believes; or None.

        Raises:
            ValueError: if a count is below 1, or there is no policy of that name.
        """
        self.render_mode = render_mode
        self._looks: list[int] = []  # of this search
        self.searches = SearchSeries(1, homes, policy, max_looks, queries_per_home, max_furniture)
        self.labels: list[str] = self.searches.rollout.homes.labels
        self.observation_space = self.searches.observation_space
        self.num_furniture = self.searches.num_furniture
        self.action_space = Discrete(self.num_furniture)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the next search; see the class for when it is in a new home.

        Raises:
            ValueError, TypeError: if the options are others than `new_home`.
        """
        is_new = reads_new_home(options) or seed is not None
        super().reset(seed=seed)
        self.searches.start(self.np_random, is_new)
        self._looks = []
        return self._observe(), self._get_info()

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Look at a furniture node.

        Raises:
            ValueError: if there is no such furniture.
            RuntimeError: if the search is over.
        """
        if action not in self.action_space:
            raise ValueError(
                f"action must be a furniture index from 0 to {self.num_furniture - 1}, got "
                f"{shorten(action)}. Choose one that info['action_mask'] allows."
            )
        search = self.searches.search
        if search.is_over[0]:
            raise RuntimeError(
                "search must not be over, got a look after its end. Call reset first."
            )
        search.look(np.zeros(1, dtype=np.int64), np.array([action]))
        self._looks += [int(action)] * bool(action < search.is_open.shape[1])
        is_found = bool(search.is_found[0])
        is_cut_off = bool(search.is_over[0]) and not is_found
        return self._observe(), -1.0, is_found, is_cut_off, self._get_info()

    def compute_scores(self) -> np.ndarray:
        """Ask the policy how likely each furniture node holds the object, (F,)."""
        return self.searches.compute_scores()[0]

    def render(self) -> np.ndarray | None:
        """Draw the belief of the policy, the looks in their order and where the object is.

        Returns:
            uint8 (height, width, 3), or None as `render_mode` says.
        """
        if self.render_mode is None:
            return None
        # Here, as who trains needs no pictures.
        from matplotlib.figure import Figure

        from simulator.drawing import FloorPlan, draw_belief, draw_pixels

        rollout, search = self.searches.rollout, self.searches.search
        plan = FloorPlan.of_homes(rollout.homes)
        belief = compute_probabilities(search.scores(), rollout.policy.score_kind)
        figure = Figure(figsize=(6.4, 5.2), dpi=100, layout="constrained")
        axes = draw_belief(
            figure.subplots(),
            plan,
            belief[0],
            order=self._looks,
            true_places=np.flatnonzero(search.answers[0]).tolist(),
        )
        axes.set_title(self.searches.describe(0), loc="left")
        return draw_pixels(figure)

    def action_masks(self) -> np.ndarray:
        """Return what was not yet looked at in this search, bool (F,), as MaskablePPO asks."""
        return self.searches.action_mask[0].astype(bool)

    def compute_place_rows(self) -> np.ndarray:
        """Return what is remembered of each furniture node, float32 (F, D)."""
        searches = self.searches
        (rows,) = compute_place_rows(searches.rollout.memory, searches.search.queries)
        return np.pad(rows, ((0, self.num_furniture - len(rows)), (0, 0)))

    def _observe(self) -> dict[str, Any]:
        return {name: column[0] for name, column in self.searches.observe().items()}

    def _get_info(self) -> dict[str, Any]:
        info = self.searches.get_info()
        return {
            name: column[0] if column.ndim > 1 else column.item() for name, column in info.items()
        }


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
            ValueError: if only some homes are to be reset, seeds come one by one, or there is an
                option of another name.
            TypeError: if `new_home` is neither true nor false.
        """
        is_new = reads_new_home(options, (NEW_HOME, "reset_mask")) or seed is not None
        if isinstance(seed, list):
            raise ValueError(
                f"seed must be one number for all homes, got {seed}. They differ by their number."
            )
        if not np.all((options or {}).get("reset_mask", True)):
            raise ValueError(
                "homes must be reset together, got a reset_mask for some. Step until all searches "
                "are over, or use vectorization_mode='sync'."
            )
        super().reset(seed=seed)
        self.searches.start(self.np_random, is_new)
        return self.searches.observe(), self.searches.get_info()

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
        is_cut_off = search.is_over & ~is_found
        observation, info = self.searches.observe(), self.searches.get_info()
        return observation, rewards, is_found, is_cut_off, info

    def compute_scores(self) -> np.ndarray:
        """Ask the policy how likely each furniture node holds the object, (H, F)."""
        return self.searches.compute_scores()

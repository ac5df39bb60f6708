"""A grid home played by its furniture: an action is where to look next."""

from __future__ import annotations

from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete

from sgm.messages import shorten
from simulator.igridson.agent import plan_look
from simulator.igridson.env import IGridsonEnv


class GoAndLook(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Walks to the furniture node that an action names, by a shortest path, and looks at it.

    An action stands for all turns, steps and the look; its reward is the sum of theirs.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self._grid = cast(IGridsonEnv, env.unwrapped)
        self.action_space = Discrete(self._grid.num_furniture)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Go to a furniture node and look at it.

        Raises:
            ValueError: if there is no such furniture.
        """
        if action not in self.action_space:
            raise ValueError(
                f"action must be a furniture index from 0 to {self._grid.num_furniture - 1}, got "
                f"{shorten(action)}. Choose one that action_masks allows."
            )
        total = 0.0
        for move in plan_look(self._grid, int(action)):
            observation, reward, is_over, is_cut_off, info = self.env.step(move)
            total += float(reward)
            if is_over or is_cut_off:
                break
        return observation, total, is_over, is_cut_off, info

    def action_masks(self) -> np.ndarray:
        """Return which furniture was not yet looked at in this search, bool (F,)."""
        return self._grid.search.is_open[0].copy()

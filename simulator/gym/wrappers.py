"""Flat observations for libraries of reinforcement learning that know neither graphs nor texts."""

from __future__ import annotations

from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box


class FlatPlaces(gymnasium.ObservationWrapper[np.ndarray, Any, Any]):
    """Shows a row of features per furniture node, one after the other, float32 (F D,).

    For `FindObject-v0` and `iGridson-v0`, instead of a graph, or of images and texts; their
    `place_columns` name the D features, and `observation.reshape(F, D)` has the rows. Which actions
    make sense says `action_masks()`, as MaskablePPO of sb3-contrib asks for it.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self._places = cast(Any, env.unwrapped)  # of ours: both have `compute_place_rows`
        size = self._places.num_furniture * len(self._places.place_columns)
        self.observation_space = Box(-np.inf, np.inf, (size,), np.float32)

    def observation(self, observation: Any) -> np.ndarray:
        """Return the features of now, whatever the environment shows."""
        rows: np.ndarray = self._places.compute_place_rows()
        return rows.ravel()

    def action_masks(self) -> np.ndarray:
        """Return which actions make sense, bool (A,)."""
        masks: np.ndarray = self.env.get_wrapper_attr("action_masks")()
        return masks

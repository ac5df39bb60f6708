"""An agent that plays iGridson-v0 from its observations, one action at a time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from simulator.igridson.env import GridAction, IGridsonEnv
from simulator.igridson.find_object import Searcher
from simulator.igridson.navigation import DIRECTIONS
from simulator.igridson.travel import compute_belief
from simulator.igridson.walk import Walk
from simulator.tasks.rollout import make_memory


class GridAgent:
    """Remembers what it sees, asks its policy, walks to the place it chose, and looks.

    It knows the layout and the prior; of the home it knows what its observations told it. The
    memory is kept until the environment changes to another home.

    Attributes:
        memory: what it believes, a batch of one.
    """

    def __init__(self, env: IGridsonEnv, searcher: Searcher) -> None:
        """Be an agent without experience."""
        self._env = env
        self._searcher = searcher
        self._walk = Walk(env.routes, 1)
        self._settle_in()

    def search(self, seed: int | None = None) -> Iterator[None]:
        """Play one episode; yields after the reset and after every action."""
        env = self._env
        observation, _ = env.reset(seed=seed)
        self.begin(observation)
        yield
        is_over = False
        while not is_over:
            for action in self.plan(self.choose()):
                observation, _, terminated, truncated, _ = env.step(action)
                is_over = terminated or truncated
                if observation["looked"]:
                    self.remember(observation)
                yield
                if is_over:
                    return

    def begin(self, observation: dict[str, Any]) -> None:
        """Take note of a new query, after a reset."""
        if self._homes is not self._env.homes:
            self._settle_in()
        self.memory.step()
        code = np.array([observation["query"]])
        types = self._type_of_code[code]
        self._queries = self.memory.query(np.zeros(1, int), code, self._label_of_type[types], types)
        self._is_open = np.ones((1, self.memory.num_furniture), dtype=bool)
        self.believe()

    def believe(self) -> np.ndarray:
        """Score the furniture, show the belief in the environment's pictures, return (1, F)."""
        scores = self._policy.scores(self.memory, self._queries)
        if self._is_open.any():
            belief = compute_belief(scores, self._policy.score_kind, self._is_open)
            self._env.belief = belief[0]
        return scores

    def choose(self) -> int:
        """Choose the furniture node to look at next."""
        env = self._env
        self._walk.cell[0] = env.routes.find_cell(env.position)
        home = np.zeros(1, dtype=np.int64)
        uniform = env.homes.streams.rows("search ties", 1).take(home)[:, 0]
        return int(self._order.choose(home, self.believe(), self._is_open, uniform)[0])

    def plan(self, furniture: int) -> Iterator[GridAction]:
        """List the actions that lead to a furniture node, face it and look at it."""
        env = self._env
        cell = env.routes.find_cell(env.position)
        direction = int(env.agent_dir)
        path = env.routes.find_path(cell, furniture, direction)
        for (x, y), (next_x, next_y) in pairwise(path):
            wanted = DIRECTIONS.index((next_x - x, next_y - y))
            yield from plan_turns(direction, wanted)
            yield GridAction.forward
            direction = wanted
        x, y = path[-1]
        facing = [
            index
            for index, (step_x, step_y) in enumerate(DIRECTIONS)
            if env.layout.furniture_at[y + step_y, x + step_x] == furniture
        ]
        yield from min((plan_turns(direction, wanted) for wanted in facing), key=len)
        yield GridAction.look

    def remember(self, observation: dict[str, Any]) -> None:
        """Fold a look into the memory."""
        codes, relations = np.nonzero(observation["seen"])
        home = np.zeros(len(codes), dtype=np.int64)
        types = self._type_of_code[codes]
        rows = self.memory.ensure_objects(home, codes, self._label_of_type[types], types)
        looked = np.array([observation["looked"] - 1])
        change = self.memory.observe(np.zeros(1, dtype=np.int64), looked, rows, relations)
        self._policy.observe(self.memory, change)
        self._is_open[0, looked] = False

    def _settle_in(self) -> None:
        """Start with an empty memory in a new home."""
        homes = self._homes = self._env.homes
        self.memory = make_memory(homes)
        self._policy = self._searcher.make(homes)
        self._policy.reset(self.memory)
        self._order = self._searcher.make_order(self._walk, self._policy)
        self._type_of_code = homes.object_descriptions.type_of_code
        index = {label: i for i, label in enumerate(self.memory.labels)}
        self._label_of_type = np.array([index[row.label] for row in homes.prior.objects])


def plan_turns(direction: int, wanted: int) -> list[GridAction]:
    """Return the fewest turns from one direction to another."""
    turns = (wanted - direction) % 4
    return [GridAction.left] if turns == 3 else [GridAction.right] * turns

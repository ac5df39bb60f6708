"""Who plays iGridson-v0, one action at a time: an agent with any policy, or the keyboard."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pygame

from simulator.igridson.env import GridAction, IGridsonEnv
from simulator.igridson.find_object import Searcher
from simulator.igridson.navigation import DIRECTIONS, Walk, compute_belief


class GridAgent:
    """Asks its policy, walks to the place it chose, and looks.

    It knows the layout and the prior; of the home it knows the environment's memory of what was
    seen, which is kept until the environment changes to another home.
    """

    def __init__(self, env: IGridsonEnv, searcher: Searcher) -> None:
        """Be an agent without experience; the next search is in a new home."""
        self._env = env
        self._searcher = searcher
        self._walk = Walk(env.routes, 1)
        env.set_policy(searcher.make)

    def search(self, seed: int | None = None) -> Iterator[None]:
        """Play one episode; yields after the reset and after every action."""
        self._env.reset(seed=seed)
        self.believe()
        yield
        while True:
            for action in plan_look(self._env, self.choose()):
                _, _, terminated, truncated, _ = self._env.step(action)
                yield
                if terminated or truncated:
                    return

    def believe(self) -> None:
        """Show in the environment's pictures where the object may be now."""
        self._show(self._env.search.scores())

    def choose(self) -> int:
        """Choose the furniture node to look at next, and show what the choice is made from."""
        env = self._env
        self._walk.cell[0] = env.routes.find_cell(env.position)
        order = self._searcher.make_order(self._walk, env.rollout.policy)
        answer = env.search.choose(order)
        self._show(answer.scores)
        return int(answer.choice[0])

    def _show(self, scores: np.ndarray) -> None:
        env = self._env
        if env.search.is_open.any():
            score_kind = env.rollout.policy.score_kind
            env.belief = compute_belief(scores, score_kind, env.search.is_open)[0]


def plan_look(env: IGridsonEnv, furniture: int) -> Iterator[GridAction]:
    """List the actions that lead the agent to a furniture node, face it and look at it."""
    cell = env.routes.find_cell(env.position)
    direction = int(env.agent_dir)
    path = env.routes.find_path(cell, furniture, direction)
    for (x, y), (next_x, next_y) in pairwise(path):
        wanted = DIRECTIONS.index((next_x - x, next_y - y))
        yield from plan_turns(direction, wanted)
        yield GridAction.forward
        direction = wanted
    x, y = path[-1]
    turns = (
        plan_turns(direction, index)
        for index, (step_x, step_y) in enumerate(DIRECTIONS)
        if env.layout.furniture_at[y + step_y, x + step_x] == furniture
    )
    yield from min(turns, key=len)
    yield GridAction.look


def plan_turns(direction: int, wanted: int) -> list[GridAction]:
    """Return the fewest turns from one direction to another."""
    turns = (wanted - direction) % 4
    return [GridAction.left] if turns == 3 else [GridAction.right] * turns


KEYS = {
    pygame.K_LEFT: GridAction.left,
    pygame.K_RIGHT: GridAction.right,
    pygame.K_UP: GridAction.forward,
    pygame.K_SPACE: GridAction.look,
}

HELP = "arrow keys: turn and walk; space: look; n: next object; h: new home; q: quit"


def play(env: IGridsonEnv, seed: int, searcher: Searcher | None = None) -> None:
    """Let a person search in an environment of `render_mode` "human", until its window is closed.

    A searcher's belief is shown, from a memory of what the person has seen.
    """
    believe = GridAgent(env, searcher).believe if searcher is not None else lambda: None
    env.reset(seed=seed)
    believe()
    env.render()
    is_over = False
    while True:
        event = pygame.event.wait()
        if event.type == pygame.QUIT:
            return
        if event.type != pygame.KEYDOWN:
            continue
        if event.key in (pygame.K_q, pygame.K_ESCAPE):
            return
        if event.key in (pygame.K_n, pygame.K_h):
            env.reset(options={"new_home": event.key == pygame.K_h})
            is_over = False
            believe()
        elif event.key in KEYS and not is_over:
            _, _, terminated, truncated, _ = env.step(KEYS[event.key])
            is_over = terminated or truncated
            if env.is_looking:
                believe()
        env.render()

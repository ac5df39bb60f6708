"""Play iGridson with the keyboard."""

from __future__ import annotations

import pygame

from simulator.igridson.agent import GridAgent
from simulator.igridson.env import GridAction, IGridsonEnv
from simulator.igridson.find_object import Searcher

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
    agent = None if searcher is None else GridAgent(env, searcher)
    env.reset(seed=seed)
    if agent is not None:
        agent.believe()
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
            if agent is not None:
                agent.believe()
        elif event.key in KEYS and not is_over:
            _, _, terminated, truncated, _ = env.step(KEYS[event.key])
            is_over = terminated or truncated
            if agent is not None and env.is_looking:
                agent.believe()
        env.render()

"""Plays games with their players: what has not been played yet, on any number of workers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import torch

from nep.games.game import Game, checksum_code
from nep.games.score_cache import ScoreCache
from nep.report.results import describe_code
from simulator.fan_out import fan_out

GameType = TypeVar("GameType", bound=Game)


def play_all(
    games: Mapping[str, GameType],
    list_players: Callable[[GameType], Mapping[str, Any]],
    path: Path,
    networks: Mapping[str, str] = MappingProxyType({}),
    workers: int = 1,
    backend: str = "processes",
) -> ScoreCache:
    """Let all play what has not been played yet, and say which are done.

    The file of scores is written after every play; what is returned has those of other games, too.

    Raises:
        ValueError: if the file is damaged, or has scores of other games.
    """
    cache = load_played(games, path, networks)
    cache.about.update((name, game.tell()) for name, game in games.items())
    jobs = list_missing(games, list_players, cache)
    cache.save()
    if jobs:
        made = describe_code()
        for number, scores in fan_out(_play_part, [job[1:] for job in jobs], workers, backend):
            name = jobs[number][0]
            cache.keep(name, scores, made)
            print(f"{name}: {', '.join(scores)}", flush=True)
    for name, _, part in jobs:  # in their order, whichever was ready first
        for who in part:
            cache.scores[name][who] = cache.scores[name].pop(who)
    cache.save()
    return cache


def load_played(
    games: Mapping[str, GameType], path: Path, networks: Mapping[str, str] = MappingProxyType({})
) -> ScoreCache:
    """Read what has been played of games, by these networks and this code.

    Raises:
        ValueError: as `play_all` does.
    """
    described = {name: game.describe() for name, game in games.items()}
    code = {name: checksum_code(game.scored_by) for name, game in games.items()}
    return ScoreCache.load(path, described, networks, code)


def list_missing(
    games: Mapping[str, GameType],
    list_players: Callable[[GameType], Mapping[str, Any]],
    cache: ScoreCache,
) -> list[tuple[str, GameType, Mapping[str, Any]]]:
    """List what has not been played yet: name of a game, the game, and who plays in one go."""
    jobs: list[tuple[str, GameType, Mapping[str, Any]]] = []
    for name, game in games.items():
        players = list_players(game)
        missing = {who: make for who, make in players.items() if who not in cache.scores[name]}
        parts = [{who: make} for who, make in missing.items()]
        if game.plays_together and missing:
            parts = [missing]
        jobs += [(name, game, part) for part in parts]
    return jobs


def _play_part(game: Game, players: Mapping[str, Any]) -> dict[str, Any]:
    torch.set_num_threads(1)
    return game.play(players)

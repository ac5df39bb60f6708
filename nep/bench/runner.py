"""Plays the games of a suite with its players, and writes its table."""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Generic, TypeVar

import torch
from jsonargparse import ArgumentParser, Namespace

from nep.bench.game import Game, checksum_code
from nep.bench.score_cache import ScoreCache, find_scores
from nep.bench.table_options import Option, list_names, make_command
from nep.players.contestants import Checkpoint
from nep.report.results import describe_code
from sgm.files import write_whole
from simulator.command_line import add_worker_arguments, make_parser, one_line_errors, parse
from simulator.fan_out import check_workers, fan_out

GameType = TypeVar("GameType", bound=Game)


@dataclass(frozen=True, slots=True)
class Report:
    """What a table is written from.

    Attributes:
        options: of the command.
        command: that makes it again.
        cache: all that has been played.
        shown: names of the games in the table.
        networks: names of the networks in it.
    """

    options: Namespace
    command: str
    cache: ScoreCache
    shown: Sequence[str]
    networks: Sequence[str]

    @property
    def scores(self) -> dict[str, dict[str, Any]]:
        """Scores of the games in the table, by player."""
        return {name: self.cache.scores[name] for name in self.shown}

    @property
    def about(self) -> dict[str, dict[str, Any]]:
        """What the scores of the games in the table are of (`Game.tell`)."""
        return {name: self.cache.about[name] for name in self.shown}


class Suite(ABC):
    """What is played, and what is written of it: a command.

    Attributes:
        command: how it is called, `python -m` and this.
        summary: what it does, in its help.
        options: its options.
        workers: plays at a time, where none are given; None if it plays one after the other.
    """

    command: ClassVar[str]
    summary: ClassVar[str]
    options: ClassVar[tuple[Option, ...]]
    workers: ClassVar[int | None] = 1

    def check(self, options: Namespace) -> None:
        """Raise `ValueError` for what bounds do not say; nothing, here."""
        del options

    @abstractmethod
    def run(self, options: Namespace, parser: ArgumentParser) -> None:
        """Play what has not been played yet, and write."""

    def make_parser(self) -> ArgumentParser:
        """Return the parser of the command."""
        parser = make_parser(
            f"python -m {self.command}",
            f"{self.summary} Interrupted, the same command goes on; what has been played stays.",
        )
        for option in self.options:
            option.add(parser)
        if self.workers is not None:
            add_worker_arguments(parser, self.workers)
        return parser

    def main(self, arguments: Sequence[str] | None = None) -> None:
        """Run the command line."""
        parser = self.make_parser()
        torch.set_num_threads(1)
        with one_line_errors(status=2):
            options = parse(parser, arguments)
            if self.workers is not None:
                check_workers(options.workers, options.backend)
            for option in self.options:
                if options[option.name] is not None:
                    option.check(options[option.name])
            self.check(options)
            self.run(options, parser)


class TableSuite(Suite, Generic[GameType]):
    """Games, players, and one table of their scores, with its cache beside it.

    Attributes:
        options: among them those of `list_table_options`.
        shows_all: whether the table has all games that were ever played, those of `--kinds` alone
            if these are named, and not only those of this command.
        needs_networks: whether every network of the table must have played all of them.
    """

    shows_all: ClassVar[bool] = False
    needs_networks: ClassVar[bool] = True

    @abstractmethod
    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, GameType]:
        """List the games by name; `folder` is for files, and goes when they have been played."""

    @abstractmethod
    def list_players(
        self, options: Namespace, game: GameType, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Any]:
        """List what makes each player of a game, by name."""

    @abstractmethod
    def write(self, report: Report) -> list[str]:
        """Return the parts of the page, in Markdown."""

    def checksum_more(self, options: Namespace) -> Mapping[str, str]:
        """Return checksums of networks that are no `--checkpoint`, by name."""
        return {}

    def list_needed(self, options: Namespace, networks: Sequence[str]) -> Sequence[str]:
        """Name the players without which no table is written."""
        return networks if self.needs_networks else ()

    def run(self, options: Namespace, parser: ArgumentParser) -> None:
        """Play what has not been played yet, if anything is to be, and write the table."""
        path = find_scores(options.out)
        networks = list_names(options.checkpoint)
        shown: Sequence[str] = ()
        if self.shows_all and options.get("kinds"):
            shown = options.kinds
        if options.play:
            with tempfile.TemporaryDirectory() as folder:
                cache, played = self._play(options, path, Path(folder))
            if not self.shows_all:
                shown = played
        else:
            cache = ScoreCache.load_all(path, shown, self.list_needed(options, networks))
        shown = [*(shown or cache.about)]
        command = make_command(parser, options, networks)
        report = Report(options, command, cache, shown, networks)
        parts = [part.strip() for part in self.write(report)]
        write_whole(options.out, ("\n\n".join(parts) + "\n").encode())
        print(options.out)

    def _play(self, options: Namespace, path: Path, folder: Path) -> tuple[ScoreCache, list[str]]:
        checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
        games = self.list_games(options, folder)
        networks = {point.name: point.compute_checksum() for point in checkpoints}
        networks |= self.checksum_more(options)
        cache = play_all(
            games,
            lambda game: self.list_players(options, game, checkpoints),
            path,
            networks,
            options.workers,
            options.backend,
        )
        return cache, [*games]


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

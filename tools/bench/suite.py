"""A command that plays games with players, and writes a table of their scores."""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic

import torch
from jsonargparse import ArgumentParser, Namespace

from nep.games.play_all import GameType, play_all
from nep.games.score_cache import ScoreCache, find_scores
from nep.players.contestants import Checkpoint
from sgm.files import write_whole
from simulator.command_line import add_worker_arguments, make_parser, one_line_errors, parse
from simulator.fan_out import check_workers
from tools.bench.table_options import Option, list_names, make_command


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


class TableSuite(ABC, Generic[GameType]):
    """Games, players, and one table of their scores, with its cache beside it: a command.

    Attributes:
        command: how it is called, `python -m` and this.
        summary: what it does, in its help.
        options: its options, among them those of `list_table_options`.
        shows_all: whether the table has all games that were ever played, those of `--kinds` alone
            if these are named, and not only those of this command.
        needs_networks: whether every network of the table must have played all of them.
    """

    command: ClassVar[str]
    summary: ClassVar[str]
    options: ClassVar[tuple[Option, ...]]
    shows_all: ClassVar[bool] = False
    needs_networks: ClassVar[bool] = True

    def check(self, options: Namespace) -> None:
        """Raise `ValueError` for what bounds do not say; nothing, here."""
        del options

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

    def make_parser(self) -> ArgumentParser:
        """Return the parser of the command."""
        parser = make_parser(
            f"python -m {self.command}",
            f"{self.summary} Interrupted, the same command goes on; what has been played stays.",
        )
        for option in self.options:
            option.add(parser)
        add_worker_arguments(parser, workers=1)
        return parser

    def main(self, arguments: Sequence[str] | None = None) -> None:
        """Run the command line."""
        parser = self.make_parser()
        torch.set_num_threads(1)
        with one_line_errors(status=2):
            options = parse(parser, arguments)
            check_workers(options.workers, options.backend)
            for option in self.options:
                if options[option.name] is not None:
                    option.check(options[option.name])
            self.check(options)
            self.run(options, parser)

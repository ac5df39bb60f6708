"""The cache of scores of a table: the JSON file beside it, with which a command goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

from filelock import FileLock

from sgm.files import (
    VERSION,
    MissingFileError,
    VersionError,
    check_version,
    read_json,
    write_whole,
)
from sgm.messages import shorten


def find_scores(table: Path) -> Path:
    """Return the file of scores beside a table.

    Raises:
        ValueError: if the table cannot be written there: it is a folder, or the file of scores.
    """
    if table.suffix == ".json":
        raise ValueError(
            f"out must be a page, got {table}, which is its file of scores. Name a table.md."
        )
    if table.is_dir():
        raise ValueError(f"out must be a file, got a folder at {table}. Name a table.")
    return table.with_suffix(".json")


@dataclass(frozen=True, slots=True)
class ScoreCache:
    """The scores of a table, and what they are of, so that none is taken for another's.

    Attributes:
        path: of the file.
        games: checksum of the homes, questions and options of each game, by name.
        networks: checksum of each network that has played, by name.
        scores: of each game and player; players called "NAME" or "NAME more" are network NAME's.
        about: title of each game, and what each of its scores is of (`Game.tell`), by name.
        made: version of the package and commit that each game was last played with, by name.
        code: checksum of the code that scores each game, by name.
    """

    path: Path
    games: dict[str, str] = field(default_factory=dict)
    networks: dict[str, str] = field(default_factory=dict)
    scores: dict[str, dict[str, Any]] = field(default_factory=dict)
    about: dict[str, dict[str, Any]] = field(default_factory=dict)
    made: dict[str, str] = field(default_factory=dict)
    code: dict[str, str] = field(default_factory=dict)

    @classmethod
    def load(
        cls,
        path: Path,
        games: Mapping[str, Any],
        networks: Mapping[str, str],
        code: Mapping[str, str] = MappingProxyType({}),
    ) -> ScoreCache:
        """Read what has been played; nothing where there is no file.

        The scores of a network that is another one by now, under the same name, are left out: it
        plays again; so do all players of a game that other code scores by now.

        Args:
            path: the file.
            games: everything that a score depends on but player and code, as JSON values, by game.
            networks: checksums of the networks that play, by name.
            code: checksums of the code that scores the games, by name.

        Raises:
            ValueError: if the file is damaged, or one of its games is of that name only.
        """
        played = cls._read(path, may_be_missing=True)
        for name, game in games.items():
            checksum = hashlib.sha256(json.dumps(game, sort_keys=True).encode()).hexdigest()
            if played.games.setdefault(name, checksum) != checksum:
                raise ValueError(
                    f"scores must be of the same homes, questions and options, got others for "
                    f"{name} in {path}. Give another --out, or remove the file to play again."
                )
            played.scores.setdefault(name, {})
        for name, checksum in code.items():
            if played.code.setdefault(name, checksum) != checksum:
                print(f"{name} is scored by other code than in {path}: it is played again")
                played.scores[name], played.code[name] = {}, checksum
        for name, checksum in networks.items():
            if played.networks.get(name, checksum) != checksum:
                print(f"{name} is another network than that in {path}: it plays again")
                for by_player in played.scores.values():
                    for player in [who for who in by_player if played._is_of(who, name)]:
                        del by_player[player]
            played.networks[name] = checksum
        return played

    def keep(self, game: str, scores: Mapping[str, Any], made: str) -> None:
        """Add scores of a game, by player, and write the file.

        What other commands have written since it was read stays.
        """
        self.scores[game].update(scores)
        self.made[game] = made
        self.save()

    def _take_in(self, found: ScoreCache) -> None:
        """Add what another command has played of the same games, code and networks."""
        others = {
            name
            for name, checksum in found.networks.items()
            if self.networks.get(name, checksum) != checksum
        }
        for game, by_player in found.scores.items():
            if any(
                getattr(self, part).setdefault(game, known) != known
                for part in ("games", "code")
                if (known := getattr(found, part).get(game)) is not None
            ):
                continue
            for player, scores in by_player.items():
                if not any(found._is_of(player, name) for name in others):
                    self.scores.setdefault(game, {}).setdefault(player, scores)
        for part in ("networks", "about", "made"):
            for name, value in getattr(found, part).items():
                getattr(self, part).setdefault(name, value)

    def _is_of(self, player: str, network: str) -> bool:
        more = player.startswith(f"{network} ") and player not in self.networks
        return player == network or more

    @classmethod
    def load_all(
        cls, path: Path, names: Sequence[str] | None, players: Sequence[str]
    ) -> ScoreCache:
        """Read all that has been played, without the homes and networks themselves.

        Each of these games, None for all, must have been played by each of the players.

        Raises:
            ValueError: if the file is missing or damaged, does not say what a game is, or lacks a
                game or a player.
        """
        played = cls._read(path)
        for name in names or played.scores:
            if name not in played.scores:
                raise ValueError(
                    f"games must be some of {', '.join(played.scores)}, got {shorten(name)}, which "
                    f"is not in {path}. Play it first."
                )
            if name not in played.about:
                raise ValueError(
                    f"scores must say what they are of, got nothing for {name} in {path}. Run the "
                    "command with its homes once; what has been played stays."
                )
            for player in players:
                if player not in played.scores[name]:
                    raise ValueError(
                        f"checkpoint must be one that has played, got {shorten(player)}, which has "
                        f"not played {name} in {path}. Play it, or leave it out."
                    )
        return played

    @classmethod
    def _read(cls, path: Path, may_be_missing: bool = False) -> ScoreCache:
        try:
            found = read_json(path, allow_nan=True)
            check_version("scores", found["version"], path)
            parts = [found[field.name] for field in fields(cls)[1:]]
            if not all(isinstance(part, dict) for part in (*parts, *parts[2].values())):
                raise ValueError("something else")
        except FileNotFoundError as error:
            if may_be_missing:
                return cls(path)
            raise MissingFileError(
                f"scores must be a file, got none at {path}. Play first."
            ) from error
        except VersionError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"scores must be a JSON object of games, networks and scores, got {error} in "
                f"{path}. Remove the file to play again."
            ) from error
        return cls(path, *parts)

    def save(self) -> None:
        """Write the file, whole or not at all, making the folder if needed."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(self.path.with_name(f".{self.path.name}.lock")):
            self._take_in(self._read(self.path, may_be_missing=True))
            parts = {field.name: getattr(self, field.name) for field in fields(self)[1:]}
            content = f"{_lay_out({'version': VERSION, **parts})}\n".encode()
            if not self.path.exists() or self.path.read_bytes() != content:
                write_whole(self.path, content)


def _lay_out(value: Any, depth: int = 3) -> str:
    """Return JSON with a line for the scores of each player."""
    if not depth or not isinstance(value, dict):
        return json.dumps(value)
    rows = (f"{json.dumps(name)}: {_lay_out(part, depth - 1)}" for name, part in value.items())
    return "{\n" + ",\n".join(rows) + "\n}"

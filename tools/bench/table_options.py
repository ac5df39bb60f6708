"""What commands that write a table share: options, and the line that stands above it."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jsonargparse import ArgumentParser, Namespace

from nep.games.score_cache import ScoreCache
from sgm.checks import check_at_least, check_at_most, check_shares
from sgm.messages import shorten
from sgm.network.shipped import list_shipped, split_name

MOST = 10_000  # of homes, days, and looks or questions in a time step
_NOT_KEPT = "a commit that was not kept"
_SHOWN = 12  # digits of a checksum that is whole in the JSON
_FOLDERS = ("trace", "recorded", "cut")
_UNSAID = ("out", "card", "config", "play", "workers", "backend", "what")


@dataclass(frozen=True, slots=True)
class Option:
    """An option of a suite.

    Attributes:
        name: without hyphens.
        default: where it is left out.
        help: what it says.
        low, high: bounds of the number, or of each of several; None for none.
        type: of its value; that of the default if left out, names for an empty tuple.
        known: what its values may be; None for anything.
    """

    name: str
    default: Any
    help: str
    low: int | None = None
    high: int | None = None
    type: Any = None
    known: Collection[str] | None = None

    def add(self, parser: ArgumentParser) -> None:
        """Add it to the parser of a command."""
        value_type = self.type or type(self.default)
        if value_type is tuple:
            value_type = tuple[type(self.default[0]) if self.default else str, ...]  # type: ignore[misc]
        parser.add_argument(f"--{self.name}", type=value_type, default=self.default, help=self.help)

    def check(self, value: Any) -> None:
        """Raise `ValueError` if a value is out of bounds."""
        if isinstance(self.default, float) and (self.low, self.high) == (0, 1):
            check_shares(**{self.name: value})
            return
        for number in (value or (0,)) if isinstance(value, tuple) else (value,):
            if self.known is not None and number not in self.known:
                raise ValueError(
                    f"{self.name} must be some of {', '.join(self.known)}, got {shorten(number)}. "
                    "Choose among these."
                )
            if self.low is not None:
                check_at_least(self.low, **{self.name: number})
            if self.high is not None:
                check_at_most(self.high, **{self.name: number})


def count(name: str, default: int, text: str, low: int = 1) -> Option:
    """Return an option that counts something: homes, days, looks, questions."""
    return Option(name, default, text, low, MOST)


def list_table_options(
    out: str, checkpoints: tuple[str, ...], about: str = ""
) -> tuple[Option, ...]:
    """List the options of the table and of the networks in it."""
    played = "false: write the table of what has been played; homes and networks are only named"
    called = "what recorded homes are, in the words of the table: 'Scripted households (HOMER)'"
    networks = f"[NAME=]SOURCE of networks{about}; may be given several times"
    return (
        Option("out", Path(out), "the table", type=Path),
        Option("checkpoint", checkpoints, networks, type=tuple[str, ...]),
        Option("play", True, played),
        Option("called", "Recorded homes", called),
    )


def list_names(sources: Sequence[str]) -> list[str]:
    """Return the names of networks that have played, from what `--checkpoint` was given."""
    names = map(split_name, sources)
    return [source if name is None else name for name, source in names]


def describe_made(played: ScoreCache, games: Sequence[str], networks: Sequence[str]) -> str:
    """Say what the scores of a table were played with, as far as it was kept."""
    code: dict[str, list[str]] = {}
    for game in games:
        code.setdefault(played.made.get(game, _NOT_KEPT), []).append(game)
    lines = [f"- Played with {made}: {', '.join(names)}." for made, names in code.items()]
    lines += [
        f"- Network `{name}`: SHA-256 `{played.networks[name]}`."
        for name in networks
        if played.networks.get(name)
    ]
    homes = ", ".join(f"{game} `{played.games[game][:_SHOWN]}`" for game in games)
    lines.append(f"- Homes, SHA-256 of their rules and seeds: {homes}.")
    return "## Made with\n\n" + "\n".join(lines)


def make_command(parser: ArgumentParser, options: Namespace, networks: Sequence[str]) -> str:
    """Return the command that plays the same: without the folders of a machine, nor defaults."""
    listed = parser.prog.split()
    for name, value in vars(options).items():
        if name in _UNSAID or value == parser.get_default(name):
            continue
        if name in _FOLDERS:
            value = ["DIR"]
        elif name == "checkpoint":
            value = list(map(_write_source, value, networks))
        elif name == "left_out":
            value = [f"{text.partition('=')[0]}=DIR" for text in value]
        listed += [f"--{name}", *(map(str, value) if isinstance(value, list | tuple) else [value])]
    return shlex.join(map(str, listed))


def _write_source(text: str, name: str) -> str:
    """Write what ships by its name, all else as NAME=FILE: the same when it has played before."""
    _, source = split_name(text)
    if name == source and source in list_shipped():
        return name
    return f"{Path(source).stem if name == source else name}=FILE"

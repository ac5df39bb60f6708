"""What commands that write a table share: options, and the line that stands above it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from jsonargparse import ArgumentParser, Namespace

from nep.bench.score_cache import ScoreCache
from sgm.network.shipped import split_name

_NOT_KEPT = "a commit that was not kept"
_SHOWN = 12  # digits of a checksum that is whole in the JSON
_FOLDERS = ("trace", "recorded")
_UNSAID = ("out", "card", "config", "play", "workers", "backend")


def add_table_options(
    parser: ArgumentParser, out: str, checkpoints: tuple[str, ...], about: str = ""
) -> None:
    """Add the options of the table and of the networks in it.

    Args:
        parser: of the command.
        out: name of the table, if none is given.
        checkpoints: networks, if none are given.
        about: what else is to be said of the networks.
    """
    parser.add_argument("--out", type=Path, default=Path(out), help="the table")
    parser.add_argument(
        "--checkpoint",
        type=tuple[str, ...],
        default=checkpoints,
        help=f"[NAME=]SOURCE of networks{about}; may be given several times",
    )
    parser.add_argument(
        "--play",
        type=bool,
        default=True,
        help="false: write the table of what has been played; homes and networks are only named",
    )
    parser.add_argument(
        "--called",
        type=str,
        default="Recorded homes",
        help="what recorded homes are, in the words of the table: 'Scripted households (HOMER)'",
    )


def list_names(sources: Sequence[str]) -> list[str]:
    """Return the names of networks that have played, from what `--checkpoint` was given."""
    names = map(split_name, sources)
    return [source if name is None else name for name, source in names]


def describe_made(played: ScoreCache, kinds: Sequence[str], networks: Sequence[str]) -> str:
    """Say what the scores of a table were played with, as far as it was kept.

    Args:
        played: the scores.
        kinds: names of the games in the table.
        networks: names of the networks in it.
    """
    code: dict[str, list[str]] = {}
    for kind in kinds:
        code.setdefault(played.made.get(kind, _NOT_KEPT), []).append(kind)
    lines = [f"- Played with {made}: {', '.join(names)}." for made, names in code.items()]
    lines += [
        f"- Network `{name}`: SHA-256 `{played.networks[name]}`."
        for name in networks
        if played.networks.get(name)
    ]
    homes = ", ".join(f"{kind} `{played.games[kind][:_SHOWN]}`" for kind in kinds)
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
            value = list(networks)
        elif name == "left_out":
            value = [f"{text.partition('=')[0]}=DIR" for text in value]
        listed += [f"--{name}", *(map(str, value) if isinstance(value, list | tuple) else [value])]
    return shlex.join(map(str, listed))

"""What commands that write a table share: options, and the line that stands above it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from jsonargparse import ArgumentParser, Namespace

from nep.players.contestants import Checkpoint

_FOLDERS = ("trace", "recorded")
_UNSAID = ("out", "card", "config")


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


def make_command(
    parser: ArgumentParser, options: Namespace, checkpoints: Sequence[Checkpoint]
) -> str:
    """Return the command that plays the same: without the folders of a machine, nor defaults."""
    listed = parser.prog.split()
    for name, value in vars(options).items():
        if name in _UNSAID or value == parser.get_default(name):
            continue
        if name in _FOLDERS:
            value = ["DIR"]
        elif name == "checkpoint":
            value = [point.name for point in checkpoints]
        elif name == "left_out":
            value = [f"{text.partition('=')[0]}=DIR" for text in value]
        listed += [f"--{name}", *(map(str, value) if isinstance(value, list | tuple) else [value])]
    return shlex.join(map(str, listed))

"""Copies a memory file while it is written: `python -m sgm.backup home.sgm out.sgm`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import tell_error
from sgm.store.home_reader import HomeReader
from sgm.store.new_file import write_new


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command, and return its status: 0 if the copy is there and whole, 1 on bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m sgm.backup",
        description="Copies a memory file whole or not at all, also while it is written "
        "(docs/database.md).",
        allow_abbrev=False,
    )
    parser.add_argument("home", type=Path, help="memory file, home.sgm")
    parser.add_argument("out", type=Path, help="file to write; an older one is replaced")
    options = parser.parse_args(arguments)
    try:
        back_up(options.home, options.out)
    except (OSError, ValueError) as error:
        print(f"error: {tell_error(error)}", file=sys.stderr)
        return 1
    print(f"backup: {options.out}, {options.out.stat().st_size} bytes")
    return 0


def back_up(home: Path, out: Path) -> None:
    """Copy a memory file as it is now, with all events, and read the copy.

    Raises:
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it is no memory file or damaged, or a memory has the other file.
        OSError: if the disk does not take it; an older copy is as it was.
    """
    if out.exists() and home.exists() and out.samefile(home):
        raise ValueError(
            f"backup must be another file than its home, got {home} twice. Name another one."
        )
    with HomeReader(home) as reader:
        write_new(out, reader.copy_to)
    SceneGraphMemory.load(out)


if __name__ == "__main__":
    sys.exit(main())

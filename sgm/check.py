"""Checks a memory file, or several: `python -m sgm.check home.sgm`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from sgm.memory.home_rows import write_clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import tell_error
from sgm.store.home_reader import HomeReader


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command, and return its status: 0 if all files are whole, 1 if one is not."""
    parser = argparse.ArgumentParser(
        prog="python -m sgm.check",
        description="Checks every page, reference and checksum of memory files, also beside the "
        "process that writes them, and makes their events again (docs/database.md).",
        allow_abbrev=False,
    )
    parser.add_argument("homes", type=Path, nargs="+", metavar="home", help="memory file, home.sgm")
    options = parser.parse_args(arguments)
    faults = {path: _find_fault(path) for path in options.homes}
    for path, fault in faults.items():
        print(f"{path}: {fault}" if fault else f"{path}: ok", file=sys.stderr if fault else None)
    return int(any(faults.values()))


def _find_fault(path: Path) -> str:
    """Say in one line what is wrong with a file; empty if nothing is."""
    try:
        with HomeReader(path) as reader:
            found = reader.find_damage()
            homes = reader.select("SELECT prior, map, clock_start, step_seconds FROM home LIMIT 2")
        if not found:
            state = SceneGraphMemory.load(path).parts.state
            clock = write_clock(state.clock).values()
            if homes != [(state.prior.checksum, state.layout.map_id, *clock)]:
                found = ["home is not the one of the last snapshot and event"]
        if found:
            return f"{'; '.join(found[:3])}. It was damaged: use a copy, or a backup"
    except (OSError, ValueError) as error:
        return tell_error(error)
    return ""


if __name__ == "__main__":
    sys.exit(main())

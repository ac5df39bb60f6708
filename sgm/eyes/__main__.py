"""The map of a memory: `python -m sgm.eyes map` writes it, `correct` takes it again."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sgm.files import read_file, write_whole
from sgm.finder.home_map import HomeMap
from sgm.layout.map_file import write_map
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import needed_to, shorten, tell_error

_MOST_BYTES = 1 << 24  # of a map


def make_parser() -> argparse.ArgumentParser:
    """Return the options of both commands."""
    parser = argparse.ArgumentParser(
        prog="python -m sgm.eyes",
        description="The map that a robot has drawn, for a person to correct (docs/eyes.md).",
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    drawn = commands.add_parser("map", help="write rooms and furniture as YAML")
    drawn.add_argument("memory", type=Path, help="memory file")
    drawn.add_argument("--out", type=Path, required=True, help="file for the map, map.yaml")
    drawn.add_argument("--frame", default="map", help="name of the frame of coordinates")
    mend = commands.add_parser("correct", help="take a corrected map into a memory")
    mend.add_argument("memory", type=Path, help="memory file, in which it is written")
    mend.add_argument("--map", type=Path, required=True, help="the corrected map.yaml")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command, and return its status: 0 if all is well, 1 on bad input."""
    options = make_parser().parse_args(arguments)
    try:
        if options.command == "map":
            draw(options.memory, options.out, options.frame)
        else:
            correct(options.memory, options.map)
    except (ValueError, KeyError, OSError, ModuleNotFoundError) as error:
        print(f"error: {tell_error(error)}", file=sys.stderr)
        return 1
    return 0


def draw(path: Path, out: Path, frame: str) -> None:
    """Write the map of a memory."""
    memory = SceneGraphMemory.load(path)
    layout = memory.layout
    write_whole(out, write_map(layout, frame).encode())
    print(f"map: {out}, {len(layout.rooms)} rooms, {len(memory.boxes)} pieces of furniture")


def correct(path: Path, map_file: Path) -> None:
    """Take a corrected map into a memory file."""
    with SceneGraphMemory.open(path) as memory:
        counts = load_map(map_file).correct(memory)
    said = ", ".join(f"{number} {change}" for change, number in counts.items() if number)
    print(f"memory: {path}, {said or 'nothing to correct'}")


def load_map(path: Path) -> HomeMap:
    """Read a map (YAML).

    Raises:
        ValueError: if it is none.
        ModuleNotFoundError: if PyYAML is not installed.
    """
    with needed_to("read a map", install="pyyaml"):
        import yaml
    try:
        data: Any = yaml.safe_load(read_file(path, _MOST_BYTES))
    except (yaml.YAMLError, RecursionError) as error:
        raise ValueError(
            f"map must be YAML, got {shorten(str(error)[:200])} in {path}. Mend the line."
        ) from None
    return HomeMap.from_values(data, str(path))


if __name__ == "__main__":
    sys.exit(main())

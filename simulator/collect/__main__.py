"""Collects snapshots: a policy plays a task in many homes, and every memory is kept on disk.

Run `python -m simulator.collect --help`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.command_line import (
    add_home_arguments,
    add_worker_arguments,
    make_parser,
    one_line_errors,
    parse,
    pick,
)
from simulator.home_options import HomeOptions
from simulator.process import run_main


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m simulator.collect",
        "Collect scene graph memories into a folder; run again to resume.",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for shards and manifest")
    parser.add_argument(
        "--num_homes", type=int | None, help="number of homes; 100, or all that there are"
    )
    parser.add_argument("--steps", type=int | None, help="time steps; 100, or all that there are")
    parser.add_argument(
        "--format",
        type=Literal["snapshots", "events"],
        default="snapshots",
        help="snapshots: the memory at every question, for nep.fit; events: what looks have shown, "
        "as CSV, and Parquet if pyarrow is installed (docs/events.md)",
    )
    parser.add_class_arguments(CollectConfig, skip={"homes", "num_homes", "steps"})
    add_home_arguments(parser)
    add_worker_arguments(parser, os.cpu_count() or 1)
    with one_line_errors():
        options = parse(parser, arguments)
        homes = HomeOptions(**pick(options, HomeOptions)).make()
        print(*homes.left_out, sep="\n", end="\n" if homes.left_out else "")
        sizes = {
            "num_homes": homes.num_homes or 100 if options.num_homes is None else options.num_homes,
            "steps": homes.num_steps or 100 if options.steps is None else options.steps,
        }
        config = CollectConfig(**pick(options, CollectConfig) | {"homes": homes} | sizes)
        if options.format == "events":
            from simulator.collect.events import write_events

            write_events(config, options.out, options.workers, options.backend)
        else:
            collect(config, options.out, workers=options.workers, backend=options.backend)


if __name__ == "__main__":
    run_main(main)

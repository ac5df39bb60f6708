"""Settles what the paper claims: `python -m nep.claims --help`."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from filelock import FileLock, Timeout
from rich.console import Console

from nep.paper.claims import ClaimsPlan, plan_claims
from nep.paper.claims_report import ClaimsReport
from nep.paper.stages import run_stages
from simulator.checks import check_at_least
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.files import write_whole
from simulator.process import run_main

_LOCK = ".lock"


def _make_plan(arguments: Sequence[str] | None) -> tuple[ClaimsPlan, Path, int, bool]:
    parser = make_parser(
        "python -m nep.claims",
        "Train and play what settles the paper's claims, as far as that is not done yet, and write "
        "claims.md and claims.json. Interrupted, the same command goes on; what is finished stays.",
    )
    folders = {
        "out": ("results", "tables"),
        "runs": ("runs/claims", "networks and scores"),
        "data": ("data", "collected snapshots"),
    }
    for name, (folder, what) in folders.items():
        parser.add_argument(f"--{name}", type=Path, default=Path(folder), help=f"folder for {what}")
    parser.add_argument(
        "--train",
        type=bool,
        default=True,
        help="false: play with the networks that are there, and write tables of what was played",
    )
    parser.add_argument("--seeds", type=int, default=3, help="trainings of every network")
    parser.add_argument(
        "--table_1",
        type=Path | None,
        help="table_1.json of nep.reproduce with seed 0: its networks are the trainings of seed 0 "
        "in homes of 32 places",
    )
    parser.add_argument("--num_homes", type=int, default=100, help="test homes")
    parser.add_argument("--steps", type=int, default=100, help="steps in each")
    parser.add_argument(
        "--epochs", type=int | None, help="of every training; what its config says if left out"
    )
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes with one thread each"
    )
    options = parse(parser, arguments)
    check_at_least(
        1, seeds=options.seeds, num_homes=options.num_homes, steps=options.steps,
        epochs=options.epochs, jobs=options.jobs,
    )  # fmt: skip
    if options.table_1 is not None and not options.table_1.is_file():
        raise ValueError(
            f"table_1 must be a file, got {options.table_1}. Name a table_1.json, or leave it out."
        )
    plan = ClaimsPlan(
        runs=options.runs,
        data=options.data,
        num_homes=options.num_homes,
        steps=options.steps,
        num_seeds=options.seeds,
        switch_seed=min(1, options.seeds - 1),
        epochs=options.epochs,
        table_1=options.table_1,
    )
    return plan, options.out, options.jobs, options.train


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    console = Console() if sys.stdout.isatty() else Console(width=100)
    with one_line_errors(status=2):
        plan, out, jobs, trains = _make_plan(arguments)
        for folder in (plan.runs, plan.data, out):
            folder.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(plan.runs / _LOCK, timeout=0):
            failed = run_stages(plan_claims(plan, trains), jobs, console)
    except Timeout:
        sys.exit(
            f"error: runs must be a folder that one command works in at a time, got {plan.runs}, "
            "where another one does. Wait until it has ended, or give another --runs."
        )
    except KeyboardInterrupt:
        sys.exit("interrupted; the same command goes on from here")
    except BrokenProcessPool:
        sys.exit("error: workers must live, got one that was killed. Give fewer --jobs.")
    with one_line_errors():
        for name, content in ClaimsReport(plan).make_files().items():
            write_whole(out / name, content)
            console.print(f"wrote {out / name}", highlight=False, markup=False)
    if failed:
        lines = [f"{name}: {error}" for name, error in failed.items()]
        sys.exit("\n".join(["error: every job must end well, got", *lines]))


if __name__ == "__main__":
    run_main(main)

"""Settles what the paper claims: `python -m tools.claims --help`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nep.bench.paper.stages import run_stages
from nep.bench.paper.work import (
    list_work_options,
    make_console,
    stop_if_failed,
    work_in,
    write_files,
)
from nep.bench.table_options import Option, add_options, check_options
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from tools.claims.plan import ClaimsPlan, plan_claims
from tools.claims.report import make_report

OPTIONS = (
    *list_work_options("runs/claims", "tables"),
    Option("train", True, "false: play with the networks that are there, and write the tables"),
    Option("seeds", 3, "trainings of every network", low=1),
    Option(
        "table_1", None, "table_1.json of nep.reproduce with seed 0: its networks are the "
        "trainings of seed 0 in homes of 32 places", type=Path | None,
    ),
    Option("num_homes", 100, "test homes", low=1),
    Option("steps", 100, "steps in each", low=1),
    Option(
        "epochs", None, "of every training; what its config says if left out", 1, type=int | None
    ),
)  # fmt: skip


def _make_plan(arguments: Sequence[str] | None) -> tuple[ClaimsPlan, Path, int, bool]:
    parser = make_parser(
        "python -m tools.claims",
        "Train and play what settles the paper's claims, as far as that is not done yet, and write "
        "claims.md and claims.json. Interrupted, the same command goes on; what is finished stays.",
    )
    add_options(parser, OPTIONS)
    options = parse(parser, arguments)
    check_options(OPTIONS, options)
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
    console = make_console()
    with one_line_errors(status=2):
        plan, out, jobs, trains = _make_plan(arguments)
        for folder in (plan.runs, plan.data, out):
            folder.mkdir(parents=True, exist_ok=True)
    with work_in(plan.runs):
        failed = run_stages(plan_claims(plan, trains), jobs, console)
    with one_line_errors():
        write_files(out, make_report(plan), console)
    stop_if_failed(failed)


if __name__ == "__main__":
    run_main(main)

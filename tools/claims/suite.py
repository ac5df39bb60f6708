"""Settles what the paper claims: `python -m nep.bench claims --help`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import ClassVar

from jsonargparse import ArgumentParser, Namespace

from nep.bench.paper.work import (
    list_work_options,
    make_console,
    run_stages,
    stop_if_failed,
    work_in,
    write_files,
)
from nep.bench.runner import Suite
from nep.bench.table_options import Option
from simulator.command_line import one_line_errors
from tools.claims.plan import ClaimsPlan
from tools.claims.report import make_report

OPTIONS = (
    *list_work_options("runs/claims", "tables"),
    Option("train", True, "false: play with the networks that are there, and write the tables"),
    Option("seeds", 3, "trainings of every network", low=1),
    Option(
        "table_1",
        None,
        "table_1.json of nep.reproduce with seed 0: its networks are the "
        "trainings of seed 0 in homes of 32 places",
        type=Path | None,
    ),
    Option("num_homes", 100, "test homes", low=1),
    Option("steps", 100, "steps in each", low=1),
    Option(
        "epochs", None, "of every training; what its config says if left out", 1, type=int | None
    ),
)


class Claims(Suite):
    """Trainings and plays of which the pages about the claims are made."""

    command = "nep.bench claims"
    summary = "Train and play what settles the paper's claims, and write claims.md and claims.json."
    options = OPTIONS
    workers: ClassVar[int | None] = os.cpu_count() or 1

    def check(self, options: Namespace) -> None:
        """Check that Table 1 is there."""
        if options.table_1 is not None and not options.table_1.is_file():
            raise ValueError(
                f"table_1 must be a file, got {options.table_1}. Name a table_1.json, or leave it "
                "out."
            )

    def run(self, options: Namespace, parser: ArgumentParser) -> None:
        """Train, play and write."""
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
        for folder in (plan.runs, plan.data, options.out):
            folder.mkdir(parents=True, exist_ok=True)
        console = make_console()
        with one_line_errors(), work_in(plan.runs):
            failed = {}
            if options.train:
                failed = run_stages(plan.plan_stages(), options.workers, console)
            plan.play(options.workers, options.backend)
            write_files(options.out, make_report(plan), console)
            stop_if_failed(failed)


main = Claims().main

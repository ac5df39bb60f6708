"""Makes the tables and the figure of the paper: `python -m nep.reproduce --help`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import torch
from jsonargparse import ArgumentParser

from nep.games.score_cache import ScoreCache
from nep.report.figures import draw_over_steps, make_png
from nep.report.results import unpack_summary
from nep.reproduce.experiments import (
    ABLATION_SETTING,
    CLAIMED_ORDER,
    SETTINGS,
    enter,
    find_models,
    list_ablations,
    list_full_models,
)
from nep.reproduce.job_stages import make_console, run_stages, stop_if_failed, work_in, write_files
from nep.reproduce.paper_tables import load_table_1, make_table_1, make_table_2
from nep.reproduce.plan import PAPER_TABLES, Plan
from nep.reproduce.weights import check_weights, export_weights
from sgm.checks import check_at_least, check_choice
from simulator.command_line import (
    add_worker_arguments,
    one_line_errors,
    parse,
    pick,
)
from simulator.command_line import (
    make_parser as make_command_parser,
)
from simulator.fan_out import check_workers
from simulator.policies import POLICIES
from simulator.process import run_main

# Everything as small as it can be, to try the command: minutes instead of hours.
_TINY_FIT = tuple(
    (
        "--data.num_homes=2 --data.steps=6 --data.num_val_homes=1 --data.batch_size=8 "
        "--trainer.max_epochs=1 --trainer.log_every_n_steps=1 --online.num_homes=1 --online.steps=2"
    ).split()
)
_TINY_HOMES, _TINY_STEPS = 3, 4
# Most of it is importing torch in each of two processes, and some 150 small jobs.
_TINY_COST = (
    "--tiny: about three minutes of two processors for all tables, a minute for --table figure "
    "--models mlp. The numbers mean nothing."
)


def make_files(plan: Plan, cache: ScoreCache, page: str = "table_1") -> dict[str, bytes]:
    """Make files, by name, from kept scores; the same scores give the same bytes."""
    results = {}
    for setting in plan.list_settings():
        networks = [enter(model, setting) for model in plan.models]
        played = cache.scores[plan.make_game(setting).name]
        results[setting] = {name: unpack_summary(played[name]) for name in POLICIES}
        results[setting] |= {
            network.title: plan.load_scores(network, cache) for network in networks
        }
    files: dict[str, bytes] = {}
    if "1" in plan.tables:
        columns = {setting: results[setting] for setting in plan.settings}
        games = [plan.make_game(setting).name for setting in plan.settings]
        made = dict.fromkeys(cache.made[name] for name in games if name in cache.made)
        told = replace(plan.describe("1"), played=tuple(made))
        files |= make_table_1(columns, told, page)
    if "2" in plan.tables:
        networks = [*list_full_models(), *list_ablations()]
        ablated = {network.name: plan.load_scores(network, cache) for network in networks}
        files |= make_table_2(ablated, plan.describe("2"))
    if "figure" in plan.tables:
        scores = results[ABLATION_SETTING]
        best = [title for title in CLAIMED_ORDER if title in scores]  # has the first colour
        order = [*best, *(title for title in scores if title not in best)]
        figure = draw_over_steps(
            {title: scores[title].values for title in order},
            best,
            title=f"{ABLATION_SETTING.title}, unseen homes",
            metric=ABLATION_SETTING.metric.title,
        )
        files["figure_4.png"] = make_png(figure, Comment=plan.describe("figure").command)
    return files


@dataclass(frozen=True, slots=True)
class Options:
    """What the command makes, of what.

    Attributes:
        table: what to make: 1, 2, figure, all
        out: folder for tables and figure
        runs: folder for networks and scores
        data: folder for collected snapshots
        models: networks of Table 1, of hms, mlp, gcn, han, hgt, heat, heat_two_heads, heat_plus,
            heat_plus_no_belief, or config files; the paper's if left out
        settings: columns of Table 1
        encoders: modules of your own with encoders of --models
        homes: those of the paper's text, or of its released code: 24 places, 120 objects, 10
            looks; give them --runs and --out of their own
        num_homes: test homes; 100 if left out
        steps: steps in each; 100 if left out
        epochs: of every training; what its config says if left out
        seed: of training and of the test homes
        seeds: trainings of every network, of this seed and those that follow; intervals are then
            over homes and trainings
        stored: table_1.json: write Table 1 again from its scores, and train and play nothing
        page: name of the files of Table 1
        called: title of its page
        weights: folder: also export the networks of the tables there, with weights.json, a list
            of their names and checksums
        check_weights: folder of --weights: check every network by its name, with --stored also
            against the checkpoints of that table, and do nothing else
        tiny: everything as small as can be, to try the command: three minutes
    """

    table: str = "all"
    out: Path = Path("results")
    runs: Path = Path("runs/reproduce")
    data: Path = Path("data")
    models: tuple[str, ...] | None = None
    settings: tuple[str, ...] = tuple(setting.name for setting in SETTINGS)
    encoders: tuple[str, ...] = ()
    homes: Literal["sampled", "paper"] = "sampled"
    num_homes: int | None = None
    steps: int | None = None
    epochs: int | None = None
    seed: int = 0
    seeds: int = 1
    stored: Path | None = None
    page: str = "table_1"
    called: str = "Table 1"
    weights: Path | None = None
    check_weights: Path | None = None
    tiny: bool = False


# Options that scores depend on, in the order in which commands name them.
_TELLING = tuple("seeds homes models settings num_homes steps epochs called encoders".split())


def make_plan(options: Options) -> Plan:
    """Return what the options ask for.

    Raises:
        ValueError: if a value is out of range.
    """
    check_choice("table", options.table, (*PAPER_TABLES, "all"))
    for name in options.settings:
        check_choice("settings", name, [setting.name for setting in SETTINGS])
    check_at_least(1, epochs=options.epochs)
    fit_options: tuple[str, ...] = _TINY_FIT if options.tiny else ()
    if options.epochs is not None:
        fit_options += (f"--trainer.max_epochs={options.epochs}",)
    homes, steps = (_TINY_HOMES, _TINY_STEPS) if options.tiny else (100, 100)
    plan = Plan(
        tables=PAPER_TABLES if options.table == "all" else (options.table,),
        models=find_models(options.models),
        num_homes=homes if options.num_homes is None else options.num_homes,
        steps=steps if options.steps is None else options.steps,
        seed=options.seed,
        fit_options=fit_options,
        runs=options.runs,
        data=options.data,
        options=tuple(_list_telling_options(options)),
        encoders=tuple(options.encoders),
        source=options.homes,
        num_trainings=options.seeds,
        settings=tuple(setting for setting in SETTINGS if setting.name in options.settings),
        title=options.called,
    )
    plan.check()
    return plan


def _list_telling_options(options: Options) -> list[str]:
    """Write down the options that scores depend on; of a file, its name."""
    listed, defaults = ["--seed", str(options.seed)], Options()
    for name in _TELLING:
        if (value := getattr(options, name)) != getattr(defaults, name):
            values = value if isinstance(value, tuple) else (value,)
            listed += [f"--{name}", *(getattr(value, "name", str(value)) for value in values)]
    return listed + ["--tiny"] * options.tiny


def make_parser() -> ArgumentParser:
    """Return the parser of the command."""
    parser = make_command_parser(
        "python -m nep.reproduce",
        "Train and play what the paper's tables need, and write them. Interrupted, the same "
        "command goes on; what has been played stays.",
    )
    parser.add_class_arguments(Options)
    add_worker_arguments(parser, workers=os.cpu_count() or 1)
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line: train, play and write, or check what is there."""
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        parsed = parse(make_parser(), arguments)
        options = Options(**pick(parsed, Options))
        check_workers(parsed.workers, parsed.backend)
        console = make_console()
        if options.check_weights is not None:
            known = load_table_1(options.stored)[1].checkpoints if options.stored else None
            print("\n".join(check_weights(options.check_weights, known)))
            return
        if options.stored is not None:
            results, provenance = load_table_1(options.stored)
            options.out.mkdir(parents=True, exist_ok=True)
            files = make_table_1(results, provenance, options.page)
            write_files(options.out, files, console)
            return
        plan = make_plan(options)
        for folder in (plan.runs, plan.data, options.out):
            folder.mkdir(parents=True, exist_ok=True)
    if options.tiny:
        console.print(_TINY_COST)
    with one_line_errors(), work_in(plan.runs):
        failed = run_stages(plan.plan_stages(), parsed.workers, console)
        cache = plan.play(parsed.workers, parsed.backend)
        stop_if_failed(failed)
        write_files(options.out, make_files(plan, cache, options.page), console)
        if options.weights is not None:
            for name in export_weights(plan, options.weights):
                console.print(f"wrote {options.weights / name}", highlight=False, markup=False)


if __name__ == "__main__":
    run_main(main)

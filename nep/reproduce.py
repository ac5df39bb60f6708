"""Makes the tables and the figure of the paper: `python -m nep.reproduce --help`."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Literal

from jsonargparse import ArgumentParser, Namespace

from nep.bench.paper.experiments import (
    ABLATION_SETTING,
    CLAIMED_ORDER,
    MODELS,
    SETTINGS,
    enter,
    find_models,
    list_ablations,
    list_full_models,
)
from nep.bench.paper.paper_tables import load_table_1, make_table_1, make_table_2
from nep.bench.paper.plan import PAPER_TABLES, Plan
from nep.bench.paper.weights import check_weights, export_weights
from nep.bench.paper.work import (
    list_work_options,
    make_console,
    run_stages,
    stop_if_failed,
    work_in,
    write_files,
)
from nep.bench.runner import Suite
from nep.bench.score_cache import ScoreCache
from nep.bench.table_options import Option
from nep.report.figures import draw_over_steps, make_png
from nep.report.results import unpack_summary
from sgm.messages import shorten
from simulator.command_line import one_line_errors
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
_CHOICES = (*PAPER_TABLES, "all")
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


_COUNT = int | None
OPTIONS = (
    Option("table", "all", f"what to make: {', '.join(_CHOICES)}"),
    *list_work_options("runs/reproduce", "tables and figure"),
    Option(
        "models",
        None,
        f"networks of Table 1, of {', '.join(model.name for model in MODELS)}, or "
        "config files; the paper's if left out",
        type=tuple[str, ...] | None,
    ),
    Option(
        "settings",
        tuple(setting.name for setting in SETTINGS),
        "columns of Table 1",
        known=tuple(setting.name for setting in SETTINGS),
    ),
    Option("encoders", (), "modules of your own with encoders of --models"),
    Option(
        "homes",
        "sampled",
        "those of the paper's text, or of its released code: 24 places, 120 "
        "objects, 10 looks; give them --runs and --out of their own",
        type=Literal["sampled", "paper"],
    ),
    Option("num_homes", None, "test homes; 100 if left out", type=_COUNT),
    Option("steps", None, "steps in each; 100 if left out", type=_COUNT),
    Option("epochs", None, "of every training; what its config says if left out", 1, type=_COUNT),
    Option("seed", 0, "of training and of the test homes"),
    Option(
        "seeds",
        1,
        "trainings of every network, of this seed and those that follow; intervals are "
        "then over homes and trainings",
    ),
    Option(
        "stored",
        None,
        "table_1.json: write Table 1 again from its scores, and train and play nothing",
        type=Path | None,
    ),
    Option("page", "table_1", "name of the files of Table 1"),
    Option("called", "Table 1", "title of its page"),
    Option(
        "weights",
        None,
        "folder: also export the networks of the tables there, with weights.json, "
        "a list of their names and checksums",
        type=Path | None,
    ),
    Option(
        "check_weights",
        None,
        "folder of --weights: check every network by its name, with "
        "--stored also against the checkpoints of that table, and do nothing else",
        type=Path | None,
    ),
    Option("tiny", False, "everything as small as can be, to try the command: three minutes"),
)
# Options that scores depend on, in the order in which commands name them.
_TELLING = tuple("seeds homes models settings num_homes steps epochs called encoders".split())
_DEFAULTS = {option.name: option.default for option in OPTIONS}


def _make_plan(options: Namespace) -> Plan:
    if options.table not in _CHOICES:
        raise ValueError(
            f"table must be one of {', '.join(_CHOICES)}, got {shorten(options.table)}. Choose one."
        )
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


def _list_telling_options(options: Namespace) -> list[str]:
    """Write down the options that scores depend on; of a file, its name."""
    listed = ["--seed", str(options.seed)]
    for name in _TELLING:
        if (value := options[name]) != _DEFAULTS[name]:
            values = value if isinstance(value, tuple) else (value,)
            listed += [f"--{name}", *(getattr(value, "name", str(value)) for value in values)]
    return listed + ["--tiny"] * options.tiny


class Paper(Suite):
    """Networks are trained for each setting, and play its test homes beside all policies."""

    command = "nep.reproduce"
    summary = "Train and play what the paper's tables need, and write them."
    options = OPTIONS
    workers: ClassVar[int | None] = os.cpu_count() or 1

    def run(self, options: Namespace, parser: ArgumentParser) -> None:
        """Train, play and write, or check what is there."""
        console = make_console()
        if options.check_weights is not None:
            known = None
            if options.stored is not None:
                known = load_table_1(options.stored)[1].checkpoints
            print("\n".join(check_weights(options.check_weights, known)))
            return
        if options.stored is not None:
            results, provenance = load_table_1(options.stored)
            options.out.mkdir(parents=True, exist_ok=True)
            files = make_table_1(results, provenance, options.page)
            write_files(options.out, files, console)
            return
        plan = _make_plan(options)
        for folder in (plan.runs, plan.data, options.out):
            folder.mkdir(parents=True, exist_ok=True)
        if options.tiny:
            console.print(_TINY_COST)
        with one_line_errors(), work_in(plan.runs):
            failed = run_stages(plan.plan_stages(), options.workers, console)
            cache = plan.play(options.workers, options.backend)
            stop_if_failed(failed)
            files = make_files(plan, cache, options.page)
            write_files(options.out, files, console)
            if options.weights is not None:
                for name in export_weights(plan, options.weights):
                    console.print(f"wrote {options.weights / name}", highlight=False, markup=False)


main = Paper().main


if __name__ == "__main__":
    run_main(main)

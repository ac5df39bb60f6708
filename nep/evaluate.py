"""Lets policies and trained networks play the tasks: `python -m nep.evaluate --help`."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from nep.players.checkpoints import list_shipped
from nep.players.contestants import Checkpoint, check_contestants, list_contestants
from nep.players.own_encoders import add_encoder_argument
from nep.report.figures import draw_over_steps
from nep.report.results import Results, ScoreSummary, list_versions
from nep.report.tables import Row, compute_rows, make_csv, make_markdown, make_rich_table
from simulator.fan_out import add_worker_arguments, check_workers
from simulator.files import write_whole
from simulator.policies import POLICIES, check_policies, list_policies
from simulator.priors.prior_graph import load_prior
from simulator.tasks.evaluation import play_games
from simulator.tasks.metrics import STEP_METRICS
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores
from simulator.trace.arguments import add_trace_arguments, read_trace_arguments
from simulator.world.config import HomeConfig
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import SPLITS, Streams

_LOG_WIDTH = 100

# By task and by policy.
Scores = Mapping[str, Mapping[str, TaskScores]]
Summaries = Mapping[str, Mapping[str, ScoreSummary]]
# Rows of the table of each task.
Tables = Mapping[str, list[Row]]


@dataclass(frozen=True, slots=True)
class EvaluateConfig:
    """What is played, by whom and where.

    Attributes:
        homes: where homes come from.
        tasks: names of tasks.
        policies: names of policies.
        checkpoints: trained networks.
        num_homes: homes, H, from number 0 on.
        steps: time steps per home, or searches of Find Object, T.
        seed: of the homes.
        split: "train", "val" or "test": their homes never coincide.
    """

    homes: HomeSource = field(default_factory=SampledSource)
    tasks: tuple[str, ...] = tuple(TASKS)
    policies: tuple[str, ...] = tuple(POLICIES)
    checkpoints: tuple[Checkpoint, ...] = ()
    num_homes: int = 100
    steps: int = 100
    seed: int = 0
    split: str = "test"

    def check(self) -> None:
        """Check everything that can be checked before anything runs.

        Raises:
            ValueError: if a value is out of range, a name unknown, or a file unfit.
        """
        for name in ("num_homes", "steps"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}. Raise it.")
        check_contestants(self.tasks, self.policies, self.checkpoints)
        self.homes.check_homes(range(self.num_homes))
        self.homes.check_steps(self.steps)
        check_policies(self.policies, self.homes)
        if any(checkpoint.load().reads_clock for checkpoint in self.checkpoints):
            self.homes.check_clock()
        # A prior without furniture for some room is noticed by the first home.
        self.homes.make(Streams(self.seed, self.split, [0]))

    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on, as JSON values."""
        settings = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            **settings,
            "homes": self.homes.describe(),
            "checkpoints": [checkpoint.describe() for checkpoint in self.checkpoints],
        }


def evaluate(
    config: EvaluateConfig,
    on_step: Callable[[str, str], None] = lambda task, name: None,
    workers: int = 1,
    backend: str = "processes",
    threads: int | None = None,
) -> Scores:
    """Let everybody play every task in the same homes; the same config gives the same scores.

    Args:
        config: what is played; `config.check()` says beforehand whether it can be.
        on_step: called with task and policy after each step; where workers play, as often at the
            end.
        workers: how many share the homes out, see `play_games`: heuristics score the same for any
            number of them, networks up to rounding.
        backend: where they work, see `fan_out`.
        threads: CPU threads of a worker; None to leave them as they are.
    """
    players = {
        task: list_contestants(task, config.policies, config.checkpoints, threads)
        for task in config.tasks
    }
    names = [(task, name) for task in players for name in players[task]]
    scores = play_games(
        [(players[task][name], task) for task, name in names],
        config.homes, Streams(config.seed, config.split, range(config.num_homes)), config.steps,
        lambda game: on_step(*names[game]), workers, backend,
    )  # fmt: skip
    results: dict[str, dict[str, TaskScores]] = {task: {} for task in config.tasks}
    for (task, name), own in zip(names, scores, strict=True):
        results[task][name] = own
    return results


def summarise(scores: Scores) -> Summaries:
    """Compute what tables and figures need."""
    return {
        task: {name: ScoreSummary.of(own) for name, own in players.items()}
        for task, players in scores.items()
    }


def compute_tables(summaries: Summaries) -> Tables:
    """Compute the rows of the table of each task."""
    return {task: compute_rows(TASKS[task], players) for task, players in summaries.items()}


def save_results(
    config: EvaluateConfig, summaries: Summaries, tables: Tables, out: Path, command: str
) -> None:
    """Write `results.json`, `table.md`, `table.csv` and a figure per task, each whole or not.

    Args:
        config: what was played.
        summaries: what came of it.
        tables: its rows.
        out: folder; made if needed.
        command: the command line that makes these files again.
    """
    stored = Results(command, config.describe(), list_versions(), summaries)
    stored.save(out / "results.json")
    parts = [
        make_markdown(TASKS[task], rows, _make_title(config, task)) for task, rows in tables.items()
    ]
    write_whole(out / "table.md", ("\n".join(parts) + f"\n`{command}`\n").encode())
    write_whole(out / "table.csv", make_csv(tables).encode())
    models = [checkpoint.name for checkpoint in config.checkpoints]
    for task, players in summaries.items():
        figure = draw_over_steps(
            {name: own.values for name, own in players.items()},
            models,
            title=f"{TASKS[task].title} on unseen homes",
            metric=STEP_METRICS[TASKS[task].metric].title,
        )
        figure.savefig(out / f"{task}_over_steps.png", metadata={"Software": None})


def print_tables(config: EvaluateConfig, tables: Tables, console: Console) -> None:
    """Print one table per task, the worst policy first."""
    for task, rows in tables.items():
        console.print(make_rich_table(TASKS[task], rows, _make_title(config, task)))


def _make_title(config: EvaluateConfig, task: str) -> str:
    homes = config.homes.make_title(config.num_homes, config.split)
    return f"{TASKS[task].title}, {homes} x {config.steps} steps"


def _make_parser() -> argparse.ArgumentParser:
    defaults = EvaluateConfig()
    parser = argparse.ArgumentParser(
        prog="python -m nep.evaluate",
        description="Let policies and trained networks play tasks in the same unseen homes.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for tables and figures")
    parser.add_argument(
        "--tasks", nargs="+", default=["all"], help="all, or some of " + ", ".join(TASKS)
    )
    parser.add_argument(
        "--policies",
        nargs="+",
        default=["all"],
        help="all, none, or some of " + ", ".join(POLICIES),
    )
    parser.add_argument(
        "--checkpoint",
        action="append",
        default=[],
        metavar="[NAME[@TASK]=]SOURCE",
        help="a trained network, for all tasks or for one: a checkpoint, an exported folder or "
        f"one that ships with the package ({', '.join(list_shipped())}); may be repeated",
    )
    add_encoder_argument(parser)
    parser.add_argument("--num_homes", type=int, default=defaults.num_homes, help="sampled homes")
    parser.add_argument("--steps", type=int, help="time steps; 100, or all recorded ones")
    parser.add_argument("--seed", type=int, default=defaults.seed, help="seed of the homes")
    parser.add_argument("--split", default=defaults.split, help=", ".join(SPLITS))
    parser.add_argument("--prior", help="prior file (JSON); the shipped one if left out")
    parser.add_argument(
        "--dynamic-nodes",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether objects are added and removed",
    )
    add_trace_arguments(parser)
    add_worker_arguments(parser, workers=1)
    parser.add_argument(
        "--threads", type=int, help="CPU threads of a worker; all cores, shared out, if left out"
    )
    return parser


def _make_config(options: argparse.Namespace) -> EvaluateConfig:
    defaults = EvaluateConfig()
    homes = read_trace_arguments(
        options, load_prior(options.prior), HomeConfig(dynamic_nodes=options.dynamic_nodes)
    )
    policies = {("all",): list_policies(homes), ("none",): ()}
    return EvaluateConfig(
        homes=homes,
        tasks=tuple(TASKS) if options.tasks == ["all"] else tuple(options.tasks),
        policies=policies.get(tuple(options.policies), tuple(options.policies)),
        checkpoints=tuple(
            Checkpoint.parse(text, options.encoder_module) for text in options.checkpoint
        ),
        num_homes=homes.num_homes or options.num_homes,
        steps=(homes.num_steps or defaults.steps) if options.steps is None else options.steps,
        seed=options.seed,
        split=options.split,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    parser = _make_parser()
    options = parser.parse_args(arguments)
    # Where there is no terminal, in a log, lines are as long as the table needs.
    console = Console() if sys.stdout.isatty() else Console(width=_LOG_WIDTH)
    try:
        if options.threads is not None and options.threads < 1:
            raise ValueError(f"threads must be at least 1, got {options.threads}. Raise it.")
        check_workers(options.workers, options.backend)
        config = _make_config(options)
        config.check()
        options.out.mkdir(parents=True, exist_ok=True)
    except (ValueError, OSError) as error:
        parser.error(str(error))
    games = [
        (task, name)
        for task in config.tasks
        for name in list_contestants(task, config.policies, config.checkpoints)
    ]
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True) as progress:
        num_groups = len(config.homes.list_groups(range(config.num_homes)))
        bar = progress.add_task("", total=len(games) * config.steps * num_groups)

        def advance(task: str, name: str) -> None:
            progress.update(bar, advance=1, description=f"{name}: {TASKS[task].title}")

        scores = evaluate(config, advance, options.workers, options.backend, options.threads)
    summaries = summarise(scores)
    tables = compute_tables(summaries)
    command = shlex.join(["python", "-m", "nep.evaluate", *arguments])
    save_results(config, summaries, tables, options.out, command)
    print_tables(config, tables, console)


if __name__ == "__main__":
    main()

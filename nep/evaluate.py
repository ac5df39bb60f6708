"""Lets policies and trained networks play the tasks: `python -m nep.evaluate --help`."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
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
from simulator.policies import POLICIES
from simulator.priors.prior_graph import PriorGraph, load_prior
from simulator.tasks.evaluation import play_games
from simulator.tasks.metrics import STEP_METRICS
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores
from simulator.trace.arguments import add_trace_arguments, read_trace_arguments
from simulator.trace.recordings import Recordings, TraceConfig
from simulator.trace.scores import check_policies, list_policies
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
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
        tasks: names of tasks.
        policies: names of policies.
        checkpoints: trained networks.
        num_homes: homes, H, all in lockstep.
        steps: time steps per home, or searches of Find Object, T.
        seed: of the homes.
        split: "train", "val" or "test": their homes never coincide.
        home: rules of the homes.
        prior: prior file; None for the shipped default.
        trace: recorded homes to play in, all of them and by their own rules; None to sample homes.
    """

    tasks: tuple[str, ...] = tuple(TASKS)
    policies: tuple[str, ...] = tuple(POLICIES)
    checkpoints: tuple[Checkpoint, ...] = ()
    num_homes: int = 100
    steps: int = 100
    seed: int = 0
    split: str = "test"
    home: HomeConfig = field(default_factory=HomeConfig)
    prior: str | None = None
    trace: TraceConfig | None = None

    def check(self) -> None:
        """Check everything that can be checked before anything runs.

        Raises:
            ValueError: if a value is out of range, a name unknown, or a file unfit.
        """
        for name in ("num_homes", "steps"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}. Raise it.")
        check_contestants(self.tasks, self.policies, self.checkpoints)
        recordings = self.load_recordings()
        readers = [row.name for row in self.checkpoints if row.load().reads_clock]
        if recordings is not None:
            recordings.check_steps(self.steps)
            check_policies(self.policies, recordings)
            if readers:
                recordings.check_clock()
            return
        if readers:
            raise ValueError(
                f"networks with features.clock must play in recorded homes, got {readers[0]} in "
                "simulated ones, in which no time of day means anything. Give --trace."
            )
        # A prior without furniture for some room is noticed by the first home.
        SampledHomes(self.load_prior(), self.home, Streams(self.seed, self.split, [0]))

    def load_prior(self) -> PriorGraph:
        """Load the prior graph that the homes are sampled from.

        Raises:
            ValueError: if the file cannot be read or is malformed.
        """
        return load_prior(self.prior)

    def load_recordings(self) -> Recordings | None:
        """Load the recorded homes; None if homes are sampled.

        Raises:
            ValueError: if a trace is missing or broken.
        """
        return None if self.trace is None else self.trace.load(self.load_prior())

    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on, as JSON values."""
        recordings = self.load_recordings()
        settings = {**asdict(self), "home": self.home.describe()}
        del settings["trace"]
        return {
            **settings,
            **({} if recordings is None else {"trace": recordings.describe()}),
            "checkpoints": [checkpoint.describe() for checkpoint in self.checkpoints],
            "prior": self.load_prior().checksum,
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
    recordings = config.load_recordings()
    make_homes: Callable[[Streams], Homes]
    if recordings is None:
        make_homes = partial(SampledHomes, config.load_prior(), config.home)
        groups: Sequence[Sequence[int]] = [range(config.num_homes)]
    else:
        make_homes, groups = recordings.make_homes, recordings.list_groups()
    players = {
        task: list_contestants(task, config.policies, config.checkpoints, threads)
        for task in config.tasks
    }
    names = [(task, name) for task in players for name in players[task]]
    scores = play_games(
        [(players[task][name], task) for task, name in names],
        make_homes, groups, config.seed, config.split, config.steps,
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
    nodes = "on" if config.home.dynamic_nodes else "off"
    if config.trace is not None:
        kind = f"{config.num_homes} recorded homes"
    else:
        kind = f"dynamic nodes {nodes}, {config.num_homes} {config.split} homes"
    return f"{TASKS[task].title}, {kind} x {config.steps} steps"


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
    trace = read_trace_arguments(options)
    everybody, homes, steps = tuple(POLICIES), options.num_homes, defaults.steps
    if trace is not None:
        recordings = trace.load(load_prior(options.prior))
        everybody = list_policies(recordings)
        homes, steps = recordings.num_homes, recordings.num_steps
    policies = {("all",): everybody, ("none",): ()}
    return EvaluateConfig(
        tasks=tuple(TASKS) if options.tasks == ["all"] else tuple(options.tasks),
        policies=policies.get(tuple(options.policies), tuple(options.policies)),
        checkpoints=tuple(
            Checkpoint.parse(text, options.encoder_module) for text in options.checkpoint
        ),
        num_homes=homes,
        steps=steps if options.steps is None else options.steps,
        seed=options.seed,
        split=options.split,
        home=HomeConfig(dynamic_nodes=options.dynamic_nodes),
        prior=options.prior,
        trace=trace,
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
        recordings = config.load_recordings()
        num_groups = 1 if recordings is None else len(recordings.list_groups())
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

"""Lets policies and trained networks play the tasks: `python -m nep.evaluate --help`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from jsonargparse import ArgumentParser, Namespace
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from nep.players.contestants import Checkpoint, check_contestants, list_contestants
from nep.report.figures import draw_task, make_png
from nep.report.results import Results, ScoreSummary, TaskTitle, describe_code, list_versions
from nep.report.tables import (
    REFERENCES,
    Row,
    compute_rows,
    make_csv,
    make_markdown,
    make_rich_table,
)
from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.messages import shorten
from sgm.network.shipped import list_shipped
from simulator.command_line import (
    add_home_arguments,
    add_worker_arguments,
    make_parser,
    one_line_errors,
    parse,
    pick,
)
from simulator.fan_out import check_workers
from simulator.home_options import HomeOptions
from simulator.policies import POLICIES, check_policies, list_policies
from simulator.policies.registry import EVENT_RULES
from simulator.process import run_main
from simulator.tasks.evaluation import play_games
from simulator.tasks.metrics import METRICS, Metric, check_metric, find_metric
from simulator.tasks.registry import TASKS, find_task, make_file_name
from simulator.tasks.scores import TaskScores
from simulator.test_sets.test_sets import compute_fingerprint, name_test_set
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams

_LOG_WIDTH = 100
_MOST_COMMAND = 300  # characters of a command in a message
RESULTS_FILE = "results.json"

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
        tasks: names of tasks, or import paths.
        metrics: import paths of metrics that are computed besides those of every table.
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
    metrics: tuple[str, ...] = ()

    @property
    def streams(self) -> Streams:
        """The streams of the homes."""
        return Streams(self.seed, self.split, range(self.num_homes))

    @property
    def more(self) -> Mapping[str, Metric]:
        """The metrics of one's own by name."""
        return {name: find_metric(name) for name in self.metrics if name not in METRICS}

    def check(self) -> None:
        """Check everything that can be checked before anything runs.

        Raises:
            ValueError: if a value is out of range, a name unknown, or a file unfit.
        """
        check_at_least(1, num_homes=self.num_homes, steps=self.steps)
        check_contestants(self.tasks, self.policies, self.checkpoints)
        for name in self.metrics:
            check_metric(find_metric(name), self.num_homes, self.steps)
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
        del settings["metrics"]  # they change nothing in what is played
        return {
            **settings,
            "homes": self.homes.describe(),
            "first_home": compute_fingerprint(self.homes, self.streams, self.steps),
            "checkpoints": [checkpoint.describe() for checkpoint in self.checkpoints],
        }


def evaluate(
    config: EvaluateConfig,
    on_step: Callable[[str, str], None] = lambda task, name: None,
    workers: int = 1,
    backend: str = "processes",
    threads: int | None = None,
) -> Scores:
    """Let all players play every task in the same homes; the same config gives the same scores.

    Args:
        config: what is played; `config.check()` says beforehand whether it can be.
        on_step: called with task and policy after each step; where workers play, as often at the
            end.
        workers: how many share the homes out, see `play_games`: the scores are the same for any
            number of them.
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
        config.homes,
        config.streams,
        config.steps,
        lambda game: on_step(*names[game]),
        workers,
        backend,
    )
    found = dict(zip(names, scores, strict=True))
    return {task: {name: found[task, name] for name in players[task]} for task in players}


def save_results(
    config: EvaluateConfig,
    summaries: Summaries,
    tables: Tables,
    out: Path,
    command: str,
    minus: Sequence[str] = REFERENCES,
) -> None:
    """Write `results.json`, `table.md`, `table.csv` and a figure per task, each whole or not."""
    classes = {task: find_task(task) for task in summaries}
    titles = {
        task: TaskTitle(task_class.title, task_class.metric) for task, task_class in classes.items()
    }
    stored = Results(command, config.describe(), list_versions(), summaries, titles)
    stored.save(out / RESULTS_FILE)
    parts = [
        make_markdown(classes[task], rows, _make_title(config, task), config.more)
        for task, rows in tables.items()
    ]
    parts.append(f"`{command}`\n\n{describe_made(config)}\n")
    write_whole(out / "table.md", "\n".join(parts).encode())
    write_whole(out / "table.csv", make_csv(tables, more=config.more, references=minus).encode())
    models = [checkpoint.name for checkpoint in config.checkpoints]
    for task, players in summaries.items():
        picture = make_png(draw_task(classes[task], players, models))
        write_whole(out / f"{make_file_name(task)}_over_steps.png", picture)


def describe_made(config: EvaluateConfig) -> str:
    """Say with which code, in which test homes and with which networks tables were made."""
    name = name_test_set(config.homes, config.streams, config.steps)
    lines = [f"- Played with {describe_code()}."]
    if name is not None:
        lines.append(f"- Test homes: `{name}` (`python -m simulator.test_sets show {name}`).")
    for checkpoint in config.checkpoints:
        lines.append(f"- Network `{checkpoint.name}`: SHA-256 `{checkpoint.describe()['sha256']}`.")
    return "\n".join(lines)


def _make_title(config: EvaluateConfig, task: str) -> str:
    homes = config.homes.make_title(config.num_homes, config.split)
    return f"{find_task(task).title}, {homes} x {config.steps} steps"


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.evaluate",
        "Let policies and trained networks play tasks in the same unseen homes.",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for tables and figures")
    several = {
        "tasks": f"all, or some of {', '.join(TASKS)}, or your own: my_module:MyTask",
        "metrics": "metrics of your own beside those of every table: my_module:my_metric, a "
        "function of TaskScores or a Metric",
        "policies": f"all, none, or some of {', '.join(POLICIES)}; those that all leaves out: "
        f"{', '.join(EVENT_RULES)}; or your own: my_module:MyPolicy",
        "checkpoint": "[NAME[@TASK]=]SOURCE: a trained network, for all tasks or for one: a "
        f"checkpoint, an exported folder or one that ships ({', '.join(list_shipped())}); may be "
        "repeated",
        "encoders": "modules of your own with the encoders of exported networks",
        "minus": "policies and networks from which the table has the differences of all others; "
        f"{', '.join(REFERENCES)} if left out",
    }
    for name, text in several.items():
        default = ("all",) if name in ("tasks", "policies") else ()
        parser.add_argument(f"--{name}", type=tuple[str, ...], default=default, help=text)
    parser.add_argument("--num_homes", type=int | None, help="homes; 100, or all recorded ones")
    parser.add_argument("--steps", type=int | None, help="time steps; 100, or all that there are")
    parser.add_class_arguments(
        EvaluateConfig,
        skip={"homes", "tasks", "policies", "checkpoints", "num_homes", "steps", "metrics"},
    )
    add_home_arguments(parser)
    add_worker_arguments(parser, workers=1)
    parser.add_argument(
        "--threads",
        type=int | None,
        help="CPU threads of a worker; all cores, shared out, if left out",
    )
    return parser


def _make_config(options: Namespace) -> EvaluateConfig:
    homes = HomeOptions(**pick(options, HomeOptions)).make()
    policies = {("all",): list_policies(homes), ("none",): ()}
    return EvaluateConfig(
        homes=homes,
        tasks=tuple(TASKS) if options.tasks == ("all",) else options.tasks,
        policies=policies.get(options.policies, options.policies),
        checkpoints=tuple(Checkpoint.parse(text, options.encoders) for text in options.checkpoint),
        num_homes=homes.num_homes or 100 if options.num_homes is None else options.num_homes,
        steps=homes.num_steps or 100 if options.steps is None else options.steps,
        seed=options.seed,
        split=options.split,
        metrics=tuple(options.metrics),
    )


def _find_references(named: Sequence[str], config: EvaluateConfig) -> Sequence[str]:
    """Return what differences are taken from; what is named must play one of the tasks."""
    players = {
        player
        for task in config.tasks
        for player in list_contestants(task, config.policies, config.checkpoints)
    }
    for name in named:
        if name not in players:
            raise ValueError(
                f"minus must name what plays, got {shorten(name)}. Name some of "
                f"{', '.join(sorted(players))}, or add it to --policies or --checkpoint."
            )
    return named or REFERENCES


def _check_folder(out: Path, command: str) -> None:
    """Raise ValueError if a folder holds the results of another command, or a broken file."""
    path = out / RESULTS_FILE
    if path.exists() and (other := Results.load(path).command) != command:
        raise ValueError(
            f"out must not hold other results, got those of `{shorten(other, _MOST_COMMAND)}` in "
            f"{out}. Choose another folder."
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    # Where there is no terminal, in a log, lines are as long as the table needs.
    console = Console() if sys.stdout.isatty() else Console(width=_LOG_WIDTH)
    with one_line_errors(status=2):
        options = parse(_make_parser(), arguments)
        check_at_least(1, threads=options.threads)
        check_workers(options.workers, options.backend)
        config = _make_config(options)
        config.check()
        minus = _find_references(options.minus, config)
        command = shlex.join(["python", "-m", "nep.evaluate", *arguments])
        _check_folder(options.out, command)
        options.out.mkdir(parents=True, exist_ok=True)
    for line in config.homes.left_out:
        console.print(f"Left out: {line}", markup=False)
    num_games = sum(
        len(list_contestants(task, config.policies, config.checkpoints)) for task in config.tasks
    )
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        num_groups = len(config.homes.list_groups(range(config.num_homes)))
        bar = progress.add_task("", total=num_games * config.steps * num_groups)

        def advance(task: str, name: str) -> None:
            progress.update(bar, advance=1, description=f"{name}: {find_task(task).title}")

        scores = evaluate(config, advance, options.workers, options.backend, options.threads)
    units, more = config.homes.list_units(range(config.num_homes)), config.more
    summaries = {
        task: {name: ScoreSummary.of(scores, units, more) for name, scores in players.items()}
        for task, players in scores.items()
    }
    tables = {
        task: compute_rows(find_task(task), players, minus) for task, players in summaries.items()
    }
    save_results(config, summaries, tables, options.out, command, minus)
    for task, rows in tables.items():
        console.print(make_rich_table(find_task(task), rows, _make_title(config, task), more))


if __name__ == "__main__":
    run_main(main)

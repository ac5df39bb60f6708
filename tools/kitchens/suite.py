"""Finders and policies in homes recorded by the minute: `python -m tools.bench kitchens --help`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jsonargparse import Namespace

from nep.players.contestants import Checkpoint
from nep.report.tables import join_table
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.source import RecordedSource, check_step_seconds
from simulator.trace.trace import find_traces, load_trace
from simulator.world.config import HomeConfig
from tools.bench.columns import make_table
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, count, describe_made, list_table_options
from tools.bench.task_game import TaskGame
from tools.kitchens.robot import POOLS, KitchenGame, compute_calibration_error

_ABOUT = """\
`{command}`.
{what}
Names are those of the annotators ("left half of third orange"), and names are the only identity.
Carried things are nowhere. Nothing was trained in these homes. One home is one unit: these tables
have no intervals, and a difference in one of them may be that of one cook.

**A robot by the minute.** No robot was there. One is put in: it looks at {looks} random places
every {step_seconds:g} s, misses {miss:.0%} of what is there, and rests while nothing is moved for
{rest:g} minutes. Each step has two questions about things that it has seen and that are there:
one about anything, and one about what was moved within ten minutes. All finders read the same
memories, in {replays} lives of each home.

*First*: the first place is right. *Among 3*: one of the first three is. *NLL*: negative log
likelihood of where it is, in nats. *Confidence*: probability of the first place. *Calibration
error*: by how much it differs from how often that is right, in ten bins."""
_TASKS = """\
**The tasks of the paper** are played in the same homes with the gaps between recordings cut out, by
steps of {step_seconds:g} s, with the household prior. There half of the questions are about what
has moved in that very step, and the robot looks where its policy answers."""


class Kitchens(TableSuite[Any]):
    """A robot by the minute, and the tasks of the paper, in recorded kitchens."""

    command = "tools.bench kitchens"
    summary = (
        "Let a robot look around by the minute in recorded homes while things are moved there, and "
        "ask finders; and play the tasks in the same homes without their gaps."
    )

    options = (
        *list_table_options("kitchens.md", ("any_home",)),
        Option("trace", (), "recorded homes, or folders of them, for the robot by the minute"),
        Option("cut", (), "the same without gaps between recordings, for the tasks; may be none"),
        Option("step_seconds", 60.0, "length of a step"),
        count("looks", 2, "looks in each time step"),
        Option("miss_rate", 0.2, "share of what is there that a look misses", 0, 1),
        Option("rest_minutes", 30.0, "where nothing is moved for longer, the robot rests"),
        count("replays", 3, "lives of each home"),
        Option("what", "Recorded homes.", "what the homes are, in sentences of the page"),
    )

    def check(self, options: Namespace) -> None:
        """Check the length of a step, and that there are homes."""
        check_step_seconds(options.step_seconds)
        if not options.rest_minutes > 0:
            raise ValueError(
                f"rest_minutes must be above 0, got {options.rest_minutes:g}. Take 30."
            )
        if options.play and not options.trace:
            raise ValueError("trace must be one or more recorded homes, got none. Name a folder.")

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, Any]:
        """List the robot's lives, and the tasks where there are homes without gaps."""
        del folder
        seeds = tuple(range(options.replays))
        games: dict[str, Any] = {}
        for path in find_traces(options.trace):
            games[path.name] = KitchenGame(
                load_trace(path),
                options.step_seconds,
                options.looks,
                options.miss_rate,
                options.rest_minutes,
                seeds,
            )
        for path in find_traces(options.cut) if options.cut else ():
            source = RecordedSource(
                PriorGraph.household(), HomeConfig(), [str(path)], options.step_seconds
            )
            num_steps = source.num_steps or 1
            title = f"{path.name}, tasks of the paper"
            games[f"{path.name} tasks"] = TaskGame(title, (source,), 1, num_steps, num_steps, seeds)
        return games

    def list_players(
        self, options: Namespace, game: Any, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Any]:
        """List rules and networks: finders of a robot, policies of the tasks."""
        players: Mapping[str, Any] = game.list_players(checkpoints)
        return players

    def write(self, report: Report) -> list[str]:
        """Return what was done, and the tables of every home."""
        options = report.options
        about = _ABOUT.format(
            command=report.command,
            what=options.what,
            looks=options.looks,
            step_seconds=options.step_seconds,
            miss=options.miss_rate,
            rest=options.rest_minutes,
            replays=options.replays,
        )
        parts = [f"# {options.called}", about]
        by_task = []
        for name, told in report.about.items():
            heading = f"## {told['title'][:1].upper()}{told['title'][1:]}"
            if told.get("asks") == "robot":
                parts += [heading, make_robot_tables(report.scores[name])]
            else:
                by_task += [heading, make_table(report.scores[name])]
        if by_task:
            parts += [_TASKS.format(step_seconds=options.step_seconds), *by_task]
        return [*parts, describe_made(report.cache, report.shown, report.networks)]


def make_robot_tables(scores: Mapping[str, Mapping[str, Any]]) -> str:
    """Return Markdown tables of what finders said, one for each of `POOLS`."""
    tables = []
    for pool, title in POOLS.items():
        rows = []
        number = 0
        for who, sums in scores.items():
            pool_sums = sums[pool]
            number = int(pool_sums["number"])
            means = [pool_sums[name] / max(number, 1) for name in ("first", "among_first", "nll")]
            error = compute_calibration_error(pool_sums["bins"])
            cells = [f"{value:.3f}" for value in (*means, pool_sums["confidence"] / max(number, 1))]
            rows.append([who, *cells, f"{error:.3f}"])
        header = ["who", "first", "among 3", "NLL", "confidence", "calibration error"]
        if number:
            tables.append(f"Asked for {title}, {number} questions:")
            tables.append(join_table(header, rows).strip())
    return "\n\n".join(tables)


main = Kitchens().main

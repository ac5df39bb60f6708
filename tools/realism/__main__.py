"""Command line: `python -m tools.realism`, how simulated and recorded homes behave."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sgm.checks import check_at_least
from sgm.files import write_whole
from simulator.command_line import make_parser, one_line_errors, parse, pick
from simulator.process import run_main
from simulator.trace.source import RecordedSource
from simulator.trace.trace import find_traces
from simulator.world.config import HomeConfig
from simulator.world.mixture.lived_in_homes import LivedInSource, make_mixture
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from tools.realism.measures import MEASURES
from tools.realism.report import (
    RealismColumn,
    draw_behaviour,
    list_outside,
    make_move_table,
    make_table,
    measure_minutes,
    measure_source,
)

# Simulated homes of the report: the paper's size, the size of the recorded homes that we know, and
# the paper's own dynamics in the latter.
_PAPER_SIZE = HomeConfig(dynamics=RoutineDynamics())
_SMALL_SIZE = HomeConfig(furniture_per_room=6, objects_per_furniture=2, dynamics=RoutineDynamics())
_AT_RANDOM = HomeConfig(furniture_per_room=6, objects_per_furniture=2, dynamic_nodes=False)
_MINUTE, _HOUR = 60.0, 3600.0
_BY_HOUR = {
    "routine, 48 objects": SampledSource(home=_SMALL_SIZE),
    "routine, 192 objects": SampledSource(home=_PAPER_SIZE),
    "paper's moves, 48 objects": SampledSource(home=_AT_RANDOM),
    "lived in": LivedInSource(mixture=make_mixture((_HOUR,)), hidden_share=0.0),
}
# Simulated homes that are measured by the minute: the first are those that networks learn in.
BY_MINUTE = {
    "lived in": LivedInSource(mixture=make_mixture((_MINUTE,))),
    "routine, 48 objects": SampledSource(
        home=replace(_SMALL_SIZE, dynamics=RoutineDynamics(step_seconds=_MINUTE))
    ),
}


@dataclass(frozen=True, slots=True)
class RealismConfig:
    """What to measure.

    Attributes:
        out: folder for `realism.md` and `realism.png`; made if needed.
        trace: recorded homes: traces, or folders of traces (docs/traces.md).
        num_homes: simulated homes of each kind.
        days: for how long all homes are followed.
        seed: of the simulated homes.
        called: what the homes of the traces are, in the words of the table.
        short: recorded homes of hours, traces or folders of them, which are measured by the minute
            alone.
        move_days: for how long homes are followed by the minute, those of `trace`, too.
    """

    out: str
    trace: Sequence[str] = ()
    num_homes: int = 30
    days: int = 60
    seed: int = 0
    called: str = "recorded homes"
    short: Sequence[str] = ()
    move_days: int = 2

    def __post_init__(self) -> None:
        """Check the counts.

        Raises:
            ValueError: if one is below 1.
        """
        check_at_least(1, num_homes=self.num_homes, days=self.days, move_days=self.move_days)


def report(config: RealismConfig) -> str:
    """Measure recorded and simulated homes, write table and figure, and return the table.

    Raises:
        ValueError: if a trace is broken.
        OSError: if the folder cannot be written.
    """
    recorded = {}
    if config.trace:
        source = RecordedSource(folders=config.trace)
        names = [folder.name for folder in find_traces(config.trace)]
        homes = measure_source(source, len(names), config.days, config.seed)
        recorded = dict(zip(names, homes, strict=True))
    simulated = [
        RealismColumn(
            name, tuple(measure_source(source, config.num_homes, config.days, config.seed))
        )
        for name, source in _BY_HOUR.items()
    ]
    outside = ""
    for column in simulated if recorded else ():
        names = list_outside(list(recorded.values()), column.compute_means())
        found = "; ".join(MEASURES[name] for name in names) or "none"
        outside += f"Outside the spread of the {config.called}, {column.name}: {found}.\n\n"
    table = f"{make_table(recorded, simulated)}\n\n{outside}"
    text = _write(config, table, _measure_by_minute(config))
    out = Path(config.out)
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "realism.md", text.encode())
    draw_behaviour(recorded, simulated, config.called).savefig(out / "realism.png")
    return text


def _measure_by_minute(config: RealismConfig) -> str:
    """Measure recorded and simulated homes by the minute, and return the table."""
    recorded = {}
    for path in find_traces((*config.trace, *config.short)) if config.trace or config.short else ():
        source = RecordedSource(folders=[str(path)], step_seconds=60.0)
        (recorded[path.name],) = measure_minutes(source, 1, config.move_days, config.seed)
    simulated = {
        name: measure_minutes(source, config.num_homes, config.move_days, config.seed)
        for name, source in BY_MINUTE.items()
    }
    return make_move_table(recorded, simulated)


def _write(config: RealismConfig, table: str, moves: str) -> str:
    """Return the text around the tables."""
    short = " --short DIR" if config.short else ""
    return "\n".join(
        [
            "# How homes behave",
            "",
            f"All homes were looked at every hour for {config.days} days: {config.called} beside "
            f"{config.num_homes} simulated homes of each kind (test homes, seed {config.seed}).",
            "Cells are mean ± standard deviation over homes, in italics where it lies outside",
            f"the spread of the {config.called}. Out of the home is a place of its own.",
            "[Simulated homes](../docs/worlds.md) says what the simulated homes are. Command: "
            f"`python -m tools.realism --trace DIR{short} --seed {config.seed} --called "
            f"{shlex.quote(config.called)} --out results`.",
            "",
            table,
            "",
            f"![Every measure: {config.called} and simulated homes](realism.png)",
            "",
            f"Dots are {config.called}, grey is their spread. Squares are medians of simulated "
            "homes; on the line of each lie nine homes of ten.",
            "",
            "## By the minute",
            "",
            f"All homes were looked at every minute for {config.move_days} days, or for as long as "
            "they were recorded. Of simulated homes the table has the median and, in brackets, "
            "what nine homes of ten lie between. A recorded home is in italics where it lies "
            "outside of that for *lived in*, in which networks are trained: its ranges are wide "
            "on purpose, and fitted to no home. Objects of a scripted household move at tens of "
            "minutes. Things of the same minute count as moved in the order of their numbers.",
            "",
            moves,
            "",
        ]
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m tools.realism",
        "How simulated and recorded homes behave, as a table and a figure: docs/worlds.md.",
    )
    parser.add_class_arguments(RealismConfig)
    with one_line_errors():
        options = parse(parser, arguments)
        print(report(RealismConfig(**pick(options, RealismConfig))))


if __name__ == "__main__":
    run_main(main)

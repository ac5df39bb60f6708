"""Command line: `python -m simulator.trace record | check | import`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from simulator.memory.clock import DEFAULT_STEP_SECONDS, Clock
from simulator.priors.prior_graph import load_prior
from simulator.trace.importers import IMPORTERS
from simulator.trace.layout import read_start
from simulator.trace.memory import remember_trace
from simulator.trace.record import record_homes
from simulator.trace.source import RecordedSource
from simulator.trace.trace import Trace, find_traces, load_trace, save_trace
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import SPLITS, Streams


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        The exit status: 0 if all is well, 1 on bad input.
    """
    options = _make_parser().parse_args(arguments)
    commands = {"record": _record, "check": _check, "import": _import}
    try:
        return commands[options.command](options)
    except (ValueError, OSError, ModuleNotFoundError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m simulator.trace", description="Recorded homes: docs/traces.md."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    defaults = argparse.ArgumentDefaultsHelpFormatter

    record = commands.add_parser(
        "record", help="simulate homes and write a trace of each", formatter_class=defaults
    )
    record.add_argument("--out", type=Path, required=True, help="folder for the traces")
    record.add_argument("--num_homes", type=int, default=1, help="number of homes")
    record.add_argument("--steps", type=int, default=100, help="time steps per home")
    record.add_argument("--split", default="test", help=", ".join(SPLITS))
    record.add_argument("--seed", type=int, default=0, help="of the homes")
    record.add_argument("--prior", help="prior file (JSON); the shipped one if left out")
    record.add_argument(
        "--dynamic-nodes",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether objects are added and removed",
    )
    record.add_argument(
        "--step-seconds", type=float, default=DEFAULT_STEP_SECONDS, help="what a step stands for"
    )
    record.add_argument("--start", metavar="TIME", help="what t = 0 stands for: 2024-05-06T07:30")

    check = commands.add_parser(
        "check", help="read traces, report the first fault, say what is in them"
    )
    check.add_argument("traces", nargs="+", metavar="DIR", help="traces, or folders of traces")
    check.add_argument("--step-seconds", type=float, help="length of a time step")
    check.add_argument("--by-day", action="store_true", help="each day is a home of its own")
    check.add_argument("--prior", help="prior file (JSON); the shipped one if left out")

    bring = commands.add_parser(
        "import",
        help="make a trace or a memory of a home from another program",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="formats:\n" + "\n".join(f"  {name:10} {f.help}" for name, f in IMPORTERS.items()),
    )
    bring.add_argument("format", choices=list(IMPORTERS), metavar="FORMAT", help="see below")
    bring.add_argument("file", type=Path, help="the file to read")
    bring.add_argument("--out", type=Path, help="folder for the trace")
    bring.add_argument(
        "--furniture",
        nargs="+",
        default=[],
        metavar="LABEL",
        help="labels that are furniture besides those of the type table (docs/priors.md)",
    )
    bring.add_argument(
        "--start", metavar="TIME", help="local date and time of the file's state: 2024-05-06T07:30"
    )
    bring.add_argument("--memory", type=Path, help="file for a memory that has seen all of it")
    bring.add_argument("--prior", help="of the memory: prior file; the shipped one if left out")
    return parser


def _record(options: argparse.Namespace) -> int:
    if options.steps < 1:
        raise ValueError(f"steps must be at least 1, got {options.steps}. Ask for more.")
    if not options.step_seconds > 0:
        raise ValueError(f"step must be a number of seconds > 0, got {options.step_seconds}.")
    config = HomeConfig(dynamic_nodes=options.dynamic_nodes)
    streams = Streams(options.seed, options.split, range(options.num_homes))
    homes = SampledHomes(load_prior(options.prior), config, streams)
    start = None if options.start is None else read_start(options.start)
    for trace in record_homes(homes, options.steps, options.step_seconds, start):
        save_trace(trace, options.out / trace.name)
        print(f"{options.out / trace.name}: {summarise(trace)}")
    return 0


def _check(options: argparse.Namespace) -> int:
    traces = [load_trace(folder) for folder in find_traces(options.traces)]
    for trace in traces:
        print(f"{trace.name}: {summarise(trace)}")
    source = RecordedSource.from_traces(
        traces, load_prior(options.prior), options.step_seconds, options.by_day
    )
    for line in source.left_out:
        print(f"left out: {line}")
    print(f"{source.num_homes} homes of at least {source.num_steps} steps")
    unknown = source.list_unknown_types()
    print(f"types that the prior does not know: {', '.join(unknown) or 'none'}")
    return 0


def _import(options: argparse.Namespace) -> int:
    if options.out is None and options.memory is None:
        raise ValueError("import must make something, got neither. Give --out or --memory.")
    trace, builder = IMPORTERS[options.format].read(options.file, options.furniture)
    if options.start is not None:
        trace = replace(trace, layout=replace(trace.layout, start=read_start(options.start)))
    print(builder.summarise())
    if options.out is not None:
        save_trace(trace, options.out)
        print(f"trace: {options.out}")
    if options.memory is not None:
        remember_trace(trace, load_prior(options.prior)).save(options.memory)
        print(f"memory: {options.memory}")
    return 0


def summarise(trace: Trace) -> str:
    """Say in one line what a trace holds."""
    layout = trace.layout
    objects = {event.object for event in trace.events}
    hours = (trace.end_s - trace.start_s) / 3600
    since = ""
    if layout.start is not None:
        since = f" from {Clock(layout.start).shift(trace.start_s).start:%A %Y-%m-%d %H:%M}"
    return (
        f"{len(layout.rooms)} rooms, {len(layout.furniture)} furniture nodes, {len(objects)} "
        f"objects, {len(trace.events)} events in {hours:.1f} hours{since}"
    )

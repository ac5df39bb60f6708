"""Command line: `python -m simulator.trace record | check | import | from-log | rooms`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from sgm.memory.memory_event import read_events
from sgm.prior.prior_graph import PRIOR_HELP, SHIPPED, load_prior
from simulator.command_line import choose, make_parser, parse
from simulator.home_options import HomeOptions
from simulator.import_command import bring
from simulator.process import run_main
from simulator.trace.from_log import make_trace, split_trace
from simulator.trace.importers.occupancy_grid import find_rooms, load_grid
from simulator.trace.layout import read_start
from simulator.trace.record import record_homes
from simulator.trace.source import RecordedSource, check_step_seconds
from simulator.trace.trace import Trace, find_traces, load_trace, save_trace
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import SPLITS, Streams

PROG = "python -m simulator.trace"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, and return the exit status: 0 if all is well, 1 on bad input."""
    return choose(
        PROG,
        {
            "record": record,
            "check": check,
            "import": bring,
            "from-log": bring_log,
            "rooms": draw_rooms,
        },
        arguments,
    )


def record(arguments: Sequence[str]) -> int:
    """Simulate homes and write a trace of each."""
    parser = make_parser(f"{PROG} record", "Simulate homes and write a trace of each.")
    parser.add_argument("--out", type=Path, required=True, help="folder for the traces")
    parser.add_argument("--num_homes", type=int, default=1, help="number of homes")
    parser.add_argument("--steps", type=int, default=100, help="time steps per home")
    parser.add_argument("--split", type=str, default="test", help=", ".join(SPLITS))
    parser.add_argument("--seed", type=int, default=0, help="of the homes")
    parser.add_class_arguments(HomeOptions, skip={"trace", "step_seconds", "by_day", "replays"})
    parser.add_argument(
        "--step_seconds", type=float, default=DEFAULT_STEP_SECONDS, help="what a step stands for"
    )
    parser.add_argument("--start", type=str | None, help="what t = 0 stands for: 2024-05-06T07:30")
    options = parse(parser, arguments)
    check_at_least(1, steps=options.steps)
    check_step_seconds(options.step_seconds)
    source = HomeOptions(options.homes, options.home, options.prior).make()
    homes = source.make(Streams(options.seed, options.split, range(options.num_homes)))
    if not isinstance(homes, SampledHomes):
        raise ValueError(
            f"homes must be sampled for their truth to be recorded, got {type(homes).__name__}. "
            "Take a source that samples."
        )
    start = None if options.start is None else read_start(options.start)
    for trace in record_homes(homes, options.steps, options.step_seconds, start):
        save_trace(trace, options.out / trace.name)
        print(f"{options.out / trace.name}: {summarise(trace)}")
    return 0


def check(arguments: Sequence[str]) -> int:
    """Read traces, report the first fault, say what is in them."""
    parser = make_parser(
        f"{PROG} check", "Read traces, report the first fault, say what they hold."
    )
    parser.add_argument("traces", nargs="+", help="traces, or folders of traces")
    parser.add_argument("--step_seconds", type=float | None, help="length of a time step")
    parser.add_argument(
        "--by_day", type=bool, default=False, help="whether each day is a home of its own"
    )
    parser.add_argument("--prior", type=str | None, help=PRIOR_HELP)
    options = parse(parser, arguments)
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
    for line in list_priors_that_know(unknown, options.prior):
        print(line)
    return 0


def list_priors_that_know(types: Sequence[str], prior: str | None) -> list[str]:
    """Say which priors that ship know types that the one given does not."""
    lines = []
    for name in SHIPPED:
        labels = {object_type.label for object_type in load_prior(name).objects}
        known = [label for label in types if label in labels]
        if known and name != (prior or "default"):
            lines.append(f"--prior {name} knows {', '.join(known)}")
    return lines


def draw_rooms(arguments: Sequence[str]) -> int:
    """Find the rooms of an occupancy grid, for robots that find furniture themselves."""
    parser = make_parser(
        f"{PROG} rooms",
        "Split the occupancy grid of a map server at its doorways, and write the rooms as polygons "
        "by name, for --areas of import bag and of the node (docs/bags.md). Name them then.",
    )
    parser.add_argument("map", type=Path, help="map.yaml of a map server, beside its image")
    parser.add_argument("--out", type=Path, required=True, help="file for the rooms, areas.yaml")
    parser.add_argument(
        "--door", type=float, default=1.0, help="metres: free floor that is narrower is a doorway"
    )
    options = parse(parser, arguments)
    if not options.door >= 0.1:
        raise ValueError(f"door must be at least 0.1 m, got {options.door:g}. Give its width.")
    rooms = find_rooms(load_grid(options.map), options.door)
    lines = [f"{json.dumps(name)}: {json.dumps(corners)}" for name, corners in rooms.items()]
    write_whole(options.out, ("\n".join(lines) + "\n").encode())
    print(f"areas: {options.out}, {len(rooms)} rooms")
    return 0


def bring_log(arguments: Sequence[str]) -> int:
    """Make traces of a home from a robot's memory, to train on and to measure with."""
    parser = make_parser(
        f"{PROG} from-log",
        "Make traces of a home from the file of a robot's memory: the first part of the time to "
        "train on, the next to validate on, the last to measure with "
        "(docs/traces.md says what they assume).",
    )
    parser.add_argument("memory", type=Path, help='of SceneGraphMemory(path="home.sgm")')
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for the traces train, val and test"
    )
    parser.add_argument(
        "--val_share", type=float, default=0.2, help="share of the time for val; 0 for none"
    )
    parser.add_argument(
        "--test_share", type=float, default=0.2, help="share of the time for test; 0 for none"
    )
    options = parse(parser, arguments)
    trace = make_trace(read_events(options.memory))
    print(f"{options.memory}: {summarise(trace)}")
    shares = {"val": options.val_share, "test": options.test_share}
    for name, part in split_trace(trace, shares).items():
        save_trace(part, options.out / name)
        print(f"{options.out / name}: {summarise(part)}")
    return 0


def summarise(trace: Trace) -> str:
    """Say in one line what a trace holds."""
    layout = trace.layout
    objects = {event.object for event in trace.events}
    hours = (trace.end_s - trace.start_s) / 3600
    since = ""
    if trace.start is not None:
        since = f" from {Clock(trace.start).shift(trace.start_s).start:%A %Y-%m-%d %H:%M}"
    return (
        f"{len(layout.rooms)} rooms, {len(layout.furniture)} furniture nodes, {len(objects)} "
        f"objects, {len(trace.events)} events in {hours:.1f} hours{since}"
    )


if __name__ == "__main__":
    run_main(main)

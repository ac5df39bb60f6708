"""Command line: `python -m simulator.trace record | check | import | from-log | rooms`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from sgm.memory.log_reader import read_log
from sgm.prior.prior_graph import PRIOR_HELP, SHIPPED, load_prior
from simulator.command_line import choose, make_parser, parse, pick
from simulator.home_options import HomeOptions
from simulator.process import run_main
from simulator.trace.from_log import make_trace, split_trace
from simulator.trace.importers import IMPORTERS
from simulator.trace.importers.occupancy_grid import find_rooms, load_grid
from simulator.trace.layout import read_start
from simulator.trace.record import record_homes
from simulator.trace.source import RecordedSource, check_step_seconds
from simulator.trace.trace import Trace, find_traces, load_trace, remember_trace, save_trace
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import SPLITS, Streams

if TYPE_CHECKING:
    from jsonargparse import ArgumentParser

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


def bring(arguments: Sequence[str]) -> int:
    """Make a trace or a memory of a home from another program."""
    if arguments[:1] == ["bag"]:
        return bring_bag(arguments[1:])
    if arguments[:1] == ["hd_epic"]:
        return bring_hd_epic(arguments[1:])
    parser = make_parser(
        f"{PROG} import",
        "Make a trace or a memory of a home from another program. Formats: "
        + "; ".join(f"{name}: {importer.help}" for name, importer in IMPORTERS.items())
        + f"; bag: a recording of ROS 2, and hd_epic: kitchens of HD-EPIC, which have options of "
        f"their own: {PROG} import bag --help, {PROG} import hd_epic --help",
    )
    parser.add_argument("format", choices=list(IMPORTERS), metavar="FORMAT", help="see above")
    parser.add_argument("file", type=Path, help="the file to read")
    _add_outputs(parser)
    parser.add_argument(
        "--furniture",
        type=tuple[str, ...],
        default=(),
        help="labels that are furniture besides those of the type table (docs/priors.md)",
    )
    parser.add_argument(
        "--labels",
        type=Path | None,
        help="of spark-dsg: names of the numbers of labels, a label space of Hydra (YAML)",
    )
    parser.add_argument(
        "--room",
        type=str | None,
        help="of spark-dsg: name of one room for all that is in none; objects without furniture "
        "lie on its floor then",
    )
    parser.add_argument(
        "--start", type=str | None, help="local date and time of the file's state: 2024-05-06T07:30"
    )
    options = parse(parser, arguments)
    if options.out is None and options.memory is None:
        raise ValueError("import must make something, got neither. Give --out or --memory.")
    trace, builder = IMPORTERS[options.format].read(
        options.file, list(options.furniture), labels=options.labels, room=options.room
    )
    if options.start is not None:
        trace = replace(trace, start=read_start(options.start))
    print(builder.summarise())
    if options.out is not None:
        save_trace(trace, options.out)
        print(f"trace: {options.out}")
    if options.memory is not None:
        remember_trace(trace, load_prior(options.prior)).save(options.memory)
        print(f"memory: {options.memory}")
    return 0


def _add_outputs(parser: ArgumentParser) -> None:
    """Add the options of what an import makes."""
    parser.add_argument("--out", type=Path | None, help="folder for the trace")
    memory = "file for a memory that has seen all of it"
    parser.add_argument("--memory", type=Path | None, help=memory)
    prior = "of the memory: default or household, which ship, or a prior file"
    parser.add_argument("--prior", default="household", help=prior)


def bring_bag(arguments: Sequence[str]) -> int:
    """Make a log of looks, a memory or a trace of a recording of ROS 2."""
    from simulator.trace.importers.bag import (
        BagOptions,
        load_areas,
        load_furniture_labels,
        load_home_map,
        read_bag,
    )

    parser = make_parser(
        f"{PROG} import bag",
        "Let a memory look at a recording of ROS 2 (sqlite3 or MCAP), and write its log, the "
        "memory or a trace (docs/bags.md). Needs the package rosbags (extra bag), and no ROS.",
    )
    parser.add_argument("folder", type=Path, help="of the bag, or its file, .mcap or .db3")
    parser.add_argument(
        "--map",
        type=Path | None,
        help="rooms and furniture with their boxes (YAML); without it they are found in the frames",
    )
    parser.add_argument(
        "--areas", type=Path | None, help="rooms as polygons by name (YAML), for what is found"
    )
    parser.add_argument(
        "--furniture_names",
        type=Path | None,
        help="further names of furniture: aliases by label (YAML), as fridge: [Kühlschrank]",
    )
    parser.add_class_arguments(BagOptions)
    parser.add_argument("--log", type=Path | None, help="new file for the log of the looks")
    _add_outputs(parser)
    options = parse(parser, arguments)
    if options.out is None and options.memory is None and options.log is None:
        raise ValueError(
            "import must make something, got none of them. Give --log, --memory or --out."
        )
    if options.log is not None and options.log.exists():
        raise ValueError(f"log must be a new file, got {options.log}. Name another one.")
    home = None if options.map is None else load_home_map(options.map)
    areas = None if options.areas is None else load_areas(options.areas)
    names = options.furniture_names
    labels = None if names is None else load_furniture_labels(names)
    with TemporaryDirectory() as folder:
        log = options.log or (options.out and Path(folder) / "looks.jsonl")
        bag_options = BagOptions(**pick(options, BagOptions))
        looks = read_bag(
            options.folder,
            home,
            bag_options,
            areas=areas,
            labels=labels,
            prior=load_prior(options.prior),
            log=log,
        )
        print(looks.summarise())
        if options.log is not None:
            print(f"log: {options.log}")
        if options.memory is not None:
            looks.memory.save(options.memory)
            print(f"memory: {options.memory}")
        if options.out is not None:
            save_trace(make_trace(read_log(log), options.folder.name), options.out)
            print(f"trace: {options.out}")
    return 0


def bring_hd_epic(arguments: Sequence[str]) -> int:
    """Make traces of kitchens of HD-EPIC."""
    from simulator.trace.importers.hd_epic import read_hd_epic

    parser = make_parser(
        f"{PROG} import hd_epic",
        "Make a trace of the kitchen of each participant of HD-EPIC, from its annotations of what "
        "was moved (docs/importers.md).",
    )
    parser.add_argument("folder", type=Path, help="with assoc_info.json and mask_info.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for the traces")
    parser.add_argument(
        "--participants", type=tuple[str, ...], default=(), help="such as P01; all if left out"
    )
    parser.add_argument(
        "--gap_minutes",
        type=float | None,
        help="between videos, which then have no date; the true times if left out",
    )
    options = parse(parser, arguments)
    read = read_hd_epic(options.folder, options.participants, options.gap_minutes)
    print(read.summarise())
    for trace in read.traces:
        save_trace(trace, options.out / trace.name)
        print(f"trace: {options.out / trace.name}")
    return 0


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
    """Make traces of a home from the log of a robot's memory, to train on and to measure with."""
    parser = make_parser(
        f"{PROG} from-log",
        "Make traces of a home from the log of a robot's memory: the first part of the time to "
        "train on, the next to validate on, the last to measure with "
        "(docs/traces.md says what they assume).",
    )
    parser.add_argument("log", type=Path, help='of SceneGraphMemory(log="looks.jsonl")')
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
    trace = make_trace(read_log(options.log))
    print(f"{options.log}: {summarise(trace)}")
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

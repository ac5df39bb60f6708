"""`python -m simulator.trace import`: homes and recordings of other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from sgm.files import make_write_error
from sgm.memory.memory_event import read_events
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph, load_prior
from simulator.command_line import make_parser, parse, pick
from simulator.trace.from_log import make_trace
from simulator.trace.importers import IMPORTERS
from simulator.trace.importers.imported_looks import ImportedLooks, TimeOptions
from simulator.trace.layout import read_start
from simulator.trace.trace import remember_trace, save_trace

if TYPE_CHECKING:
    from jsonargparse import ArgumentParser, Namespace

PROG = "python -m simulator.trace"


def bring(arguments: Sequence[str]) -> int:
    """Make a trace or a memory of a home from another program."""
    if arguments[:1] and arguments[0] in _WITH_OPTIONS:
        return _WITH_OPTIONS[arguments[0]][1](arguments[1:])
    parser = make_parser(
        f"{PROG} import",
        "Make a trace or a memory of a home from another program. Formats: "
        + "; ".join(f"{name}: {importer.help}" for name, importer in IMPORTERS.items())
        + ". With options of their own: "
        + "; ".join(f"{name}: {text}" for name, (text, _) in _WITH_OPTIONS.items())
        + f"; they say them: {PROG} import bag --help",
    )
    formats = [*IMPORTERS, *_WITH_OPTIONS]
    if arguments and not arguments[0].startswith("-") and arguments[0] not in formats:
        parser.error(
            f"format must be one of {', '.join(formats)}, got {shorten(arguments[0])}. Tables of "
            "CSV need no import: a folder with layout.json and events.csv is a trace "
            f"(docs/traces.md). {PROG} check DIR reads it."
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


def _bring_bag(arguments: Sequence[str]) -> int:
    """Make a memory or a trace of a recording of ROS 2."""
    from simulator.trace.importers.bag import (
        BagOptions,
        read_bag,
    )

    parser = make_parser(
        f"{PROG} import bag",
        "Let a memory look at a recording of ROS 2 (sqlite3 or MCAP), and write the memory "
        "or a trace (docs/bags.md). Needs the package rosbags (extra bag), and no ROS.",
    )
    parser.add_argument("folder", type=Path, help="of the bag, or its file, .mcap or .db3")
    _add_map(parser)
    parser.add_class_arguments(BagOptions)
    _add_outputs(parser)
    options = parse(parser, arguments)
    read_map = _read_map(options)

    def read(prior: PriorGraph, file: Path | None) -> ImportedLooks:
        bag_options = BagOptions(**pick(options, BagOptions))
        return read_bag(options.folder, options=bag_options, prior=prior, file=file, **read_map)

    return _write_looks(options, options.folder.name, read)


def _bring_frigate(arguments: Sequence[str]) -> int:
    """Make a memory or a trace of events of Frigate."""
    from simulator.trace.importers.frigate import load_places, read_frigate

    parser = make_parser(
        f"{PROG} import frigate",
        "Let a memory look at what cameras of Frigate have tracked, and write the memory "
        "or a trace (docs/importers.md).",
    )
    parser.add_argument(
        "file", type=Path, help="what /api/events lists, or messages of frigate/events, one a line"
    )
    parser.add_argument(
        "--places",
        type=Path | None,
        help="what zones and cameras look at (YAML): counter: {room: kitchen, furniture: counter}",
    )
    parser.add_argument(
        "--ignore", type=tuple[str, ...], default=("person",), help="labels that are no things"
    )
    parser.add_class_arguments(TimeOptions)
    _add_outputs(parser)
    options = parse(parser, arguments)
    places = None if options.places is None else load_places(options.places)

    def read(prior: PriorGraph, file: Path | None) -> ImportedLooks:
        times = TimeOptions(**pick(options, TimeOptions))
        ignore = tuple(options.ignore)
        return read_frigate(options.file, places, times, ignore=ignore, prior=prior, file=file)

    return _write_looks(options, options.file.stem, read)


def _bring_coco(arguments: Sequence[str]) -> int:
    """Make a memory or a trace of detections in the format of COCO."""
    from simulator.trace.importers.coco import CocoOptions, read_coco

    parser = make_parser(
        f"{PROG} import coco",
        "Let a memory look at detections in the format of COCO, with poses of the camera, and "
        "write the memory or a trace (docs/importers.md).",
    )
    parser.add_argument(
        "file", type=Path, help="images, categories and annotations, or a list of results"
    )
    parser.add_argument(
        "--poses", type=Path, required=True, help="timestamp tx ty tz qx qy qz qw, one a line"
    )
    parser.add_argument(
        "--camera", type=Path, required=True, help="its camera_matrix (YAML), as ROS calibrates it"
    )
    parser.add_argument(
        "--images", type=Path | None, help="images and categories of a list of results"
    )
    parser.add_argument("--depth", type=Path | None, help="folder of depth images, PNG of 16 bits")
    _add_map(parser)
    parser.add_class_arguments(CocoOptions)
    _add_outputs(parser)
    options = parse(parser, arguments)
    read_map = _read_map(options)

    def read(prior: PriorGraph, file: Path | None) -> ImportedLooks:
        return read_coco(
            options.file,
            options.poses,
            options.camera,
            CocoOptions(**pick(options, CocoOptions)),
            images=options.images,
            depth=options.depth,
            prior=prior,
            file=file,
            **read_map,
        )

    return _write_looks(options, options.file.stem, read)


def _add_map(parser: ArgumentParser) -> None:
    """Add the options that say which furniture there is."""
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


def _read_map(options: Namespace) -> dict[str, Any]:
    """Read the files of `_add_map`, as arguments of the readers."""
    from simulator.trace.importers.bag import load_areas, load_furniture_labels, load_home_map

    def read(name: str, load: Callable[[Path], Any]) -> Any:
        return None if options[name] is None else load(options[name])

    return {
        "home": read("map", load_home_map),
        "areas": read("areas", load_areas),
        "labels": read("furniture_names", load_furniture_labels),
    }


def _write_looks(
    options: Namespace, name: str, read: Callable[[PriorGraph, Path | None], ImportedLooks]
) -> int:
    """Read a recording with a prior into a memory file, and write what was asked for."""
    if options.out is None and options.memory is None:
        raise ValueError("import must make something, got none of them. Give --memory or --out.")
    if options.memory is not None and options.memory.exists():
        raise ValueError(f"memory must be a new file, got {options.memory}. Name another one.")
    with _make_folder(options.memory) as folder:
        file = Path(folder) / "home.sgm"
        looks = read(load_prior(options.prior), file)
        looks.memory.close()
        # What was read is said where something comes of it: an error has a line of its own.
        trace = None if options.out is None else make_trace(read_events(file), name)
        print(looks.summarise())
        if trace is not None:
            save_trace(trace, options.out)
            print(f"trace: {options.out}")
        if options.memory is not None:  # only one that is whole has the name
            file.rename(options.memory)
            print(f"memory: {options.memory}")
    return 0


def _make_folder(memory: Path | None) -> TemporaryDirectory[str]:
    """Make a folder for a memory that is not whole yet, beside the file that it will be."""
    where = None if memory is None else memory.parent
    try:
        return TemporaryDirectory(dir=where, prefix="import-", ignore_cleanup_errors=True)
    except OSError as error:
        raise make_write_error(error, memory or "a temporary file", 1) from error


def _bring_hd_epic(arguments: Sequence[str]) -> int:
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


# What each format with options of its own is, and its command.
_WITH_OPTIONS: Mapping[str, tuple[str, Callable[[Sequence[str]], int]]] = {
    "bag": ("a recording of ROS 2", _bring_bag),
    "coco": ("detections in the format of COCO with poses", _bring_coco),
    "frigate": ("events of Frigate", _bring_frigate),
    "hd_epic": ("kitchens of HD-EPIC", _bring_hd_epic),
}

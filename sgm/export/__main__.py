"""Writes a memory over time to a file: `python -m sgm.export mcap home.sgm out.mcap`."""

from __future__ import annotations

import argparse
import io
import signal
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import BinaryIO

from sgm.export.mcap_file import McapFile
from sgm.export.timeline import NUM_THINGS, Timeline
from sgm.files import (
    find_target,
    make_write_error,
    open_file,
    telling_write_errors,
    write_whole,
)
from sgm.memory.memory_event import MemoryEvent, parse_rows, read_kept
from sgm.messages import shorten, tell_error
from sgm.names.words import read_words
from sgm.replay.replay import replay
from sgm.serve.finders import make_finder
from sgm.store.home_reader import HomeReader
from sgm.store.owner import get_inode

_MAGIC = b"\x89MCAP0\r\n"
_SECONDS = 0.25  # between two looks at a file that is followed


def make_parser() -> argparse.ArgumentParser:
    """Return the options."""
    parser = argparse.ArgumentParser(
        prog="python -m sgm.export",
        description="Writes a memory over time to a file that other programs open (docs/mcap.md).",
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    mcap = commands.add_parser(
        "mcap",
        help="a file of MCAP for Foxglove and Rerun (extra mcap)",
        description="Writes furniture, things, looks and what is believed over time to a file of "
        "MCAP, by the schemas of Foxglove. Needs the extra mcap (docs/mcap.md).",
        allow_abbrev=False,
    )
    add = mcap.add_argument
    add("source", type=Path, help="a memory file")
    add("out", type=Path, help="file to write, out.mcap")
    add(
        "--things",
        nargs="*",
        metavar="NAME",
        help=f"whose belief is shown, in words; left out: the {NUM_THINGS} that were seen last",
    )
    add("--finder", default="any_home", help="any_home, bayesian, adaptive, or an exported folder")
    add(
        "--follow",
        action="store_true",
        help="go on with what is written to the file, as by a server, until Ctrl-C",
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command, and return its status: 0 if all is well, 1 on bad input."""
    options = make_parser().parse_args(arguments)
    try:
        _export(options)
    except (OSError, ValueError, KeyError, ModuleNotFoundError) as error:
        print(f"error: {tell_error(error)}", file=sys.stderr)
        return 1
    return 0


def _export(options: argparse.Namespace) -> None:
    for name in options.things or ():
        read_words("thing", name)
    _check_out(options.out)
    with HomeReader(options.source) as reader:
        _write(options, reader)


def _write(options: argparse.Namespace, reader: HomeReader) -> None:
    first = get_inode(reader.path)
    reader.has_changed()
    lines = read_kept(reader, from_first=True)
    things = options.things
    if things is None:
        things = _choose_things(lines) or None
    about = {"source": options.source.name, "frame": "map", "times": "local, as if they were UTC"}

    content = io.BytesIO()  # an old file stays until all is well
    file = McapFile(content, about, at_once=options.follow)
    timeline = Timeline(file, lambda: make_finder(options.finder), things)
    timeline.take(lines)
    timeline.finish_step()
    if options.follow:
        with _opened(options.out) as out:
            file.move(content, out)
            print(f"following {options.source}; Ctrl-C ends {options.out}", flush=True)
            try:
                _follow(reader, first, timeline, lines[-1].number)
            finally:
                file.finish()
    else:
        file.finish()
        write_whole(options.out, content.getvalue())
    print(f"mcap: {options.out}, {file.num_messages} messages in {file.num_topics} topics")


def _follow(reader: HomeReader, first: tuple[int, int], timeline: Timeline, number: int) -> None:
    """Go on with what comes after an event, until the process is asked to end."""
    is_ending = False

    def end(*_: int | FrameType | None) -> None:
        nonlocal is_ending
        is_ending = True

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        while not is_ending:
            _check_same(reader.path, first)
            if not reader.has_changed():
                time.sleep(_SECONDS)
                continue
            events = parse_rows(reader.read_events(number), reader.path)
            timeline.take(events)
            timeline.finish_step()
            number = events[-1].number if events else number
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _choose_things(lines: Sequence[MemoryEvent]) -> list[str]:
    """Return the things that were seen last, each name once."""
    memory = deque(replay(lines), maxlen=1)[0][0]
    return list(dict.fromkeys(name for name, _ in memory.list_seen(most=NUM_THINGS)[0]))


def _check_out(out: Path) -> None:
    """Check that no other file is written over."""
    try:
        with open_file(find_target(out)) as file:
            is_mcap = file.read(len(_MAGIC)) in (_MAGIC, b"")
    except FileNotFoundError:
        return
    except OSError as error:
        raise make_write_error(error, out, 1) from error
    if not is_mcap:
        raise ValueError(
            f"out must be a new file, or one of MCAP, got {shorten(str(out))}. Name another one."
        )


def _check_same(path: Path, first: tuple[int, int]) -> None:
    """Check that a file is still the one that was opened."""
    try:
        is_same = get_inode(path) == first
    except FileNotFoundError:
        is_same = False
    if not is_same:
        raise ValueError(
            f"memory file must stay in its place while it is followed, got another one or none at "
            f"{path}. Start again, with a new file to write."
        )


@contextmanager
def _opened(out: Path) -> Iterator[BinaryIO]:
    """Write a file; an error of the disk is said as such, at whatever time it comes."""
    with telling_write_errors(out), out.open("wb") as file:
        yield file


if __name__ == "__main__":
    sys.exit(main())

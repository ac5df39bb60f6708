"""Opens a page that looks into a file, or into a home that is played: `python -m nep.view`."""

from __future__ import annotations

import signal
import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any, NoReturn

from nep.view.answers import Desk
from nep.view.document import save_page
from nep.view.page_state import Judges, Stage
from nep.view.server import DEFAULT_PORT, PageServer
from sgm.checks import check_at_least
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.prior.prior_graph import load_prior
from sgm.store.connection import name_wal
from simulator.command_line import add_home_arguments, make_parser, one_line_errors, parse, pick
from simulator.home_options import SOURCES, HomeOptions
from simulator.policies import find_policy
from simulator.process import run_main
from simulator.story.past_memory import PastMemory, StillMemory
from simulator.story.run_recorder import record_run
from simulator.story.story import Story
from simulator.trace.trace import find_traces

WEEK = "routine"  # a simulated week with people
GRID = "igridson"
PLAYED = (WEEK, *(name for name in SOURCES if name != "recorded"), GRID)
DEFAULT_STEPS = 336  # a week of half hours
GRID_SEARCHES = 60

# What the week is short for; options of the command line come after.
_WEEK_OPTIONS = (
    "--home.dynamics routine --home.dynamics.step_seconds 1800 --home.furniture_per_room 6 "
    "--home.objects_per_furniture 3 --home.looks patrol --home.looks_per_step 2"
).split()


def list_options(source: str) -> list[str]:
    """Return the options of homes that a source stands for.

    Raises:
        ValueError: if there is no such file, folder or name.
    """
    if source == WEEK:
        return list(_WEEK_OPTIONS)
    if source in SOURCES and source in PLAYED:
        return ["--homes", source]
    if source == GRID:
        return []
    path = Path(source)
    if path.is_dir():
        find_traces([path])
        return ["--trace", source]
    if not path.exists():
        raise ValueError(
            f"source must be a memory file, a folder with a trace, "
            f"or one of {', '.join(PLAYED)}, got {shorten(source)}. Check the path."
        )
    return []


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """What the page shows.

    Attributes:
        ask: what is asked at first: "the red mug"; --save takes several.
        checkpoint: trained networks to ask beside those that ship: [NAME=]SOURCE.
        save: file to write the page to instead of opening it; it needs no server.
        port: of this machine; the next free one is taken.
        no_browser: do not open the browser.
        steps: time steps that are played; a week, or all that was recorded, if left out.
        number: of the home that is played.
        seed: of the homes.
        robot: policy of the robot that is played.
        doors: X,Y of each door between rooms, in metres; the way of a search leads through them.
    """

    ask: tuple[str, ...] = ()
    checkpoint: tuple[str, ...] = ()
    save: Path | None = None
    port: int = DEFAULT_PORT
    no_browser: bool = False
    steps: int | None = None
    number: int = 0
    seed: int = 0
    robot: str = "bayesian"
    doors: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of range.
        """
        check_at_least(0, number=self.number, seed=self.seed)
        check_at_least(1, port=self.port)
        if self.steps is not None:
            check_at_least(1, steps=self.steps)


def open_source(source: str, homes: HomeOptions, options: ViewOptions | None = None) -> Stage:
    """Open what a page shows: a source as `list_options` takes it, for a week if no steps are said.

    Raises:
        ValueError: if a file is broken, or a number out of range.
    """
    options = ViewOptions() if options is None else options
    path = Path(source)
    doors: list[Any] = [door.split(",") for door in options.doors]  # read by `Stage`
    seed, policy = options.seed, options.robot
    story: Story
    if source == GRID:
        from simulator.igridson.recorded_searches import record_searches  # an extra

        story = record_searches(options.steps or GRID_SEARCHES, seed=seed, policy=policy)
        return Stage(lambda: story, doors=doors)
    if source in PLAYED or path.is_dir():
        find_policy(policy)  # a wrong name is refused before a home is made
        made = homes.make()
        steps = options.steps or made.num_steps or DEFAULT_STEPS
        story = record_run(made, steps, home=options.number, seed=seed, policy=policy)
        return Stage(lambda: story, doors=doors)
    prior = None if homes.prior is None else load_prior(homes.prior)

    def load() -> Story:
        events = read_events(path)
        if len(events) == 1:  # saved without what led to it
            return StillMemory(SceneGraphMemory.load(path, prior), path.name)
        story = PastMemory(events, path.name, prior=prior)
        story.memory_at(story.num_steps)  # a line that cannot be made again is refused now
        return story

    return Stage(load, lambda: _find_state(path), doors)


def _find_state(path: Path) -> tuple[int, ...]:
    """Return what changes with every change of a memory file."""
    status = path.stat()
    try:
        beside = name_wal(path).stat()
    except FileNotFoundError:
        return status.st_mtime_ns, status.st_size
    return status.st_mtime_ns, status.st_size, beside.st_mtime_ns, beside.st_size


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parser = make_parser(
        "python -m nep.view [SOURCE]",
        "Open a page that looks into a memory. SOURCE is a memory file (home.sgm), "
        f"a folder with a trace, or a home that is played: {', '.join(PLAYED)}. "
        f"Left out: {WEEK}, a simulated week with people.",
    )
    parser.add_class_arguments(ViewOptions)
    add_home_arguments(parser)
    source = arguments.pop(0) if arguments and not arguments[0].startswith("-") else WEEK
    with one_line_errors(status=2):
        parsed = parse(parser, [*list_options(source), *arguments])
        options = ViewOptions(**pick(parsed, ViewOptions))
        judges = Judges(options.checkpoint)
        homes = HomeOptions(**pick(parsed, HomeOptions))
        if source in PLAYED:
            print(f"Playing {source} ...", flush=True)
        desk = Desk(open_source(source, homes, options), judges)
        # What was last asked in a run, so that the page does not begin empty.
        last = [question.description for question in desk.stage.story.questions[-1:]]
        asked = options.ask or tuple(last)
        if options.save is not None:
            save_page(desk, asked, options.save)
            print(f"Saved {options.save}")
            return
        server = PageServer(desk, options.port, next(iter(asked), ""))
        Thread(target=judges.get, args=(judges.names[0],), daemon=True).start()  # seconds
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends it as Ctrl-C does
        print(f"Open {server.address}\nCtrl-C ends it.", flush=True)
        if not options.no_browser:
            webbrowser.open(server.address)
        server.serve_forever()
    except KeyboardInterrupt:
        print()
    finally:
        server.server_close()


def run() -> NoReturn:
    """Run the command and end the process: what `sgm-view` calls."""
    run_main(main, leaves_threads=True)  # a network may be loaded, or asked by the page


if __name__ == "__main__":
    run()

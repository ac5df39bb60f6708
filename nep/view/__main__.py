"""Opens a page that looks into a memory: `python -m nep.view --help`."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

from nep.view.answers import Desk
from nep.view.page_state import Judges
from nep.view.saved_page import save_page
from nep.view.server import DEFAULT_PORT, PageServer
from nep.view.sources import PLAYED, WEEK, list_options, open_source
from sgm.checks import check_at_least
from simulator.command_line import add_home_arguments, make_parser, one_line_errors, parse, pick
from simulator.home_options import HomeOptions
from simulator.process import run_main


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


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parser = make_parser(
        "python -m nep.view [SOURCE]",
        "Open a page that looks into a memory. SOURCE is a memory file (home.sgm), a log of looks "
        f"(looks.jsonl), a folder with a trace, or a home that is played: {', '.join(PLAYED)}. "
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
        stage = open_source(
            source, homes, options.steps, options.number, options.seed, options.robot,
            [door.split(",") for door in options.doors],
        )  # fmt: skip
        desk = Desk(stage, judges)
        asked = options.ask or _list_last_asked(desk)
        if options.save is not None:
            save_page(desk, asked, options.save)
            print(f"Saved {options.save}")
            return
        server = PageServer(desk, options.port, next(iter(asked), ""))
        Thread(target=judges.get, args=(judges.names[0],), daemon=True).start()  # seconds
    print(f"Open {server.address}\nCtrl-C ends it.", flush=True)
    if not options.no_browser:
        webbrowser.open(server.address)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        print()
    finally:
        server.server_close()


def _list_last_asked(desk: Desk) -> tuple[str, ...]:
    """Return what was last asked in a run, so that the page does not begin empty."""
    return tuple(question.description for question in desk.stage.story.questions[-1:])


if __name__ == "__main__":
    run_main(main)

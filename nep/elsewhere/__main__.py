"""Measures how well finders know what is out of the home: `python -m nep.elsewhere`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jsonargparse import ArgumentParser, Namespace

from nep.elsewhere.homes import KINDS, RECORDED, STEP_SECONDS, Home, list_recorded, list_simulated
from nep.elsewhere.questions import Answers, ask
from nep.elsewhere.summary import make_tables, summarise
from nep.kinds.command import add_table_options, describe_made, list_names, make_command
from nep.kinds.played import Played, find_scores
from nep.players.contestants import Checkpoint
from nep.report.code_version import describe_code
from nep.robot.finder import ObjectFinder
from sgm.checks import check_at_least, check_at_most
from sgm.files import write_whole
from sgm.finder.finder import Finder
from sgm.memory.asking import Asked
from sgm.memory.clock import DAY_SECONDS
from sgm.policies import Adaptive, Bayesian
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main

_STEPS_PER_DAY = int(DAY_SECONDS / STEP_SECONDS)
_MOST = 10_000
_ASKED = ("days", "play_days", "looks", "questions")
WITHOUT = " without hours"

_ABOUT = """\
`{command}`.
In each home a robot looked at {looks} random places a time step of half an hour, for {days} days.
Then it went on for {play_days} days. Everything that is out at some time of these days, and as many
other things, could be asked for at every fifth step once it had been seen: {questions} such
questions at random in each home. *Without hours*: *elsewhere*
is what has left for good alone, as before things were taken to come back. All were asked of the
same memories.

Of the things that go out: how likely *elsewhere* was said to be while they were out and while they
were in, how often it was likelier than every place while they were out, the negative log likelihood
(NLL) of whether they are elsewhere and of where they are, in nats, and the calibration error of
*elsewhere* (ten bins, over all homes). *By chance*: that of somebody whose probabilities are right,
in as many questions, if these are independent. *Of all things*: the calibration error where the
others count as all things of the home that stay in it; who does not know what goes out is too low
of what does, and right of all. Of the others: *elsewhere* and the NLL of where they are.
All but the calibration errors are means over homes. Differences are paired over homes, with 95 %
intervals; d is the smallest true difference that would be found with 80 % power.

The constants of `sgm.evidence.outings` were chosen in thirty simulated homes of seed 2000 and in
household 1 of HOMER, which are not in this table."""


class _WithoutHours(Finder):
    """A finder for which things leave for good alone."""

    def _compute_out(self, asked: Asked) -> tuple[np.ndarray, np.ndarray]:
        num_things = len(asked.queries.home)
        return np.zeros(num_things), np.ones(num_things)


class _NetworkWithoutHours(_WithoutHours, ObjectFinder):
    """The same of a network."""


def list_players(checkpoints: Sequence[Checkpoint]) -> dict[str, Callable[[], Finder]]:
    """List what makes each finder, with and without the hours at which things are out."""
    players: dict[str, Callable[[], Finder]] = {
        "bayesian": lambda: Finder(Bayesian()),
        f"bayesian{WITHOUT}": lambda: _WithoutHours(Bayesian()),
        "adaptive": lambda: Finder(Adaptive()),
        f"adaptive{WITHOUT}": lambda: _WithoutHours(Adaptive()),
    }
    for point in checkpoints:
        players[point.name] = partial(ObjectFinder.load, point.path)
        players[f"{point.name}{WITHOUT}"] = partial(_NetworkWithoutHours.load, point.path)
    return players


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.elsewhere",
        "Let a robot look around in homes that things leave and come back to, and ask finders for "
        "them. Run again to resume: what has been played is in the JSON file beside the table.",
    )
    add_table_options(parser, "elsewhere.md", ("any_home",))
    parser.add_argument(
        "--kinds",
        type=tuple[str, ...],
        default=tuple(KINDS),
        help=f"of simulated homes: {', '.join(KINDS)}",
    )
    parser.add_argument("--num_homes", type=int, default=12, help="of each kind")
    parser.add_argument(
        "--trace",
        type=tuple[str, ...],
        default=(),
        help="recorded homes, or folders of them, beside the simulated ones",
    )
    parser.add_argument(
        "--outside",
        type=tuple[str, ...],
        default=(),
        help="names of furniture of recorded homes that stands outside: what is there has left",
    )
    parser.add_argument("--days", type=int, default=7, help="of looks without questions")
    parser.add_argument("--play_days", type=int, default=7, help="with questions, after these")
    parser.add_argument("--questions", type=int, default=200, help="at most, in each home")
    parser.add_argument("--looks", type=int, default=2, help="looks in each time step")
    parser.add_argument("--seed", type=int, default=0, help="of the homes, looks and questions")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = _make_parser()
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(
            1, num_homes=options.num_homes, days=options.days, play_days=options.play_days,
            looks=options.looks, questions=options.questions,
        )  # fmt: skip
        check_at_least(0, seed=options.seed)
        check_at_most(
            _MOST, num_homes=options.num_homes, days=options.days, play_days=options.play_days,
            looks=options.looks, questions=options.questions,
        )  # fmt: skip
        path = find_scores(options.out)
        if options.play:
            with tempfile.TemporaryDirectory() as folder:
                played, kinds = _play_all(options, path, Path(folder))
        else:
            played = Played.load_all(path, None, list_names(options.checkpoint))
            kinds = {name: about["kind"] for name, about in played.about.items()}
        _write(parser, options, played, kinds)


def _list_homes(options: Namespace, folder: Path) -> list[Home]:
    homes = []
    for kind in options.kinds:
        homes += list_simulated(kind, options.num_homes, options.looks, options.seed)
    if options.trace:
        homes += list_recorded(options.trace, options.outside, options.looks, folder, options.seed)
    return homes


def _play_all(options: Namespace, path: Path, folder: Path) -> tuple[Played, dict[str, str]]:
    """Let everybody play what has not been played yet; return the kind of each home by name."""
    checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
    players = list_players(checkpoints)
    homes = _list_homes(options, folder)
    asked = {name: options[name] for name in _ASKED}
    games = {home.unit: {**home.describe(), **asked} for home in homes}
    networks = {point.name: point.compute_checksum() for point in checkpoints}
    played = Played.load(path, games, networks)
    for home in homes:
        own: dict[str, Any] = played.scores[home.unit]
        played.about[home.unit] = {"title": home.unit, "units": [home.unit], "kind": home.kind}
        missing = {name: make for name, make in players.items() if name not in own}
        if missing:
            days = options.days * _STEPS_PER_DAY, options.play_days * _STEPS_PER_DAY
            questions = list(ask(home, *days, options.questions))
            for name, make in missing.items():
                own[name] = summarise(Answers.gather(make(), questions))
            played.made[home.unit] = describe_code()
            played.save()
        print(f"{home.unit}: {', '.join(own)}", flush=True)
    played.save()
    return played, {home.unit: home.kind for home in homes}


def _write(
    parser: ArgumentParser, options: Namespace, played: Played, kinds: dict[str, str]
) -> None:
    networks = list_names(options.checkpoint)
    about = _ABOUT.format(
        command=make_command(parser, options, networks), looks=options.looks, days=options.days,
        play_days=options.play_days, questions=options.questions,
    )  # fmt: skip
    titles = {kind: title for kind, (title, _) in KINDS.items()}
    titles[RECORDED] = options.called[:1].lower() + options.called[1:]
    parts = ["# Things that leave and come back", about]
    for kind in dict.fromkeys(kinds.values()):
        units = [unit for unit, own in kinds.items() if own == kind]
        scores = {unit: played.scores[unit] for unit in units}
        heading = f"## {titles[kind][:1].upper()}{titles[kind][1:]}"
        parts += [heading, make_tables(scores, WITHOUT)]
    parts.append(describe_made(played, list(kinds), networks))
    write_whole(options.out, ("\n\n".join(part.strip() for part in parts) + "\n").encode())
    print(options.out)


if __name__ == "__main__":
    run_main(main)

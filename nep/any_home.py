"""Plays networks and all policies in every kind of home: `python -m nep.any_home`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from jsonargparse import ArgumentParser, Namespace

from nep.kinds.command import add_table_options, describe_made, list_names, make_command
from nep.kinds.comparisons import compare_with_rules, count_decided, make_overview
from nep.kinds.kinds import Kind, choose_kinds, list_recorded, list_simulated
from nep.kinds.play import play_all
from nep.kinds.played import Played, find_scores
from nep.kinds.table import make_network_table, make_table
from nep.players.checkpoints import CONFIG, load_config
from nep.players.contestants import Checkpoint
from nep.report.model_card import make_card
from sgm.checks import check_at_least
from sgm.files import write_whole
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main

_RECORDED_SEEDS = 4
_RECORDED_SEARCHES = 200
_ABOUT_NETWORKS = (
    "First guess / NLL / calibration error / looks until found. Each answers what its own looks "
    "lead to."
)


def note_kinds(folder: Path, overview: str) -> None:
    """Write an overview into the notes of an exported network and its model card.

    Raises:
        ValueError: if the folder holds no exported network.
    """
    config = load_config(folder)
    config["notes"]["kinds"] = overview
    write_whole(folder / CONFIG, f"{json.dumps(config, indent=1)}\n".encode())
    write_whole(folder / "MODEL_CARD.md", make_card(folder.resolve().name, config).encode())


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.any_home",
        "Play all policies and some networks in every kind of home, and write a table. Run again "
        "to resume: what has been played is in the JSON file beside the table.",
    )
    about = ", the first one is compared with the best rule"
    add_table_options(parser, "any_home.md", ("any_home",), about)
    parser.add_argument(
        "--card", type=Path | None, help="exported folder whose card gets the overview"
    )
    parser.add_argument(
        "--recorded", type=tuple[str, ...], default=(), help="folders of recorded homes"
    )
    parser.add_argument(
        "--kinds", type=tuple[str, ...] | None, help="names of kinds; all if left out"
    )
    parser.add_argument("--num_homes", type=int, default=30, help="homes of each simulated kind")
    parser.add_argument("--steps", type=int, default=100, help="time steps in each of these")
    parser.add_argument("--searches", type=int, default=50, help="searches in each of these")
    return parser


def _list_kinds(options: Namespace) -> Mapping[str, Kind]:
    known = dict(list_simulated(options.num_homes, options.steps, options.searches))
    if options.recorded:
        seeds = tuple(range(_RECORDED_SEEDS))
        known |= list_recorded(options.recorded, _RECORDED_SEARCHES, seeds, options.called)
    return choose_kinds(known, options.kinds)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = _make_parser()
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(
            1, num_homes=options.num_homes, steps=options.steps, searches=options.searches
        )
        path = find_scores(options.out)
        if options.card is not None:
            load_config(options.card)  # before hours of playing
        if options.play:
            checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
            networks = [point.name for point in checkpoints]
            played = play_all(_list_kinds(options), checkpoints, path)
        else:
            networks = list_names(options.checkpoint)
            played = Played.load_all(path, options.kinds, networks)
        about = {name: played.about[name] for name in options.kinds or played.about}
        titles = {name: own["title"] for name, own in about.items()}
        scores = {name: played.scores[name] for name in about}
        command = make_command(parser, options, networks)
        overview = make_overview(about, scores, networks[0])
        parts = [
            "# One network in homes of every kind",
            f"`{command}`. NLL, calibration error and looks: less is better.",
            f"## `{networks[0]}` beside the best rule\n\n{overview}",
        ]
        if len(networks) > 1:
            beside = make_network_table(titles, scores, networks)
            parts.append(f"## The networks\n\n{_ABOUT_NETWORKS}\n\n{beside}")
        for name, title in titles.items():
            parts.append(f"## {title}\n\n{make_table(scores[name])}")
        parts.append(describe_made(played, list(about), networks))
        write_whole(options.out, ("\n\n".join(part.strip() for part in parts) + "\n").encode())
        if options.card is not None:
            note_kinds(options.card, overview)
        print(count_decided(about, compare_with_rules(about, scores, networks[0])))
        print(options.out)


if __name__ == "__main__":
    run_main(main)

"""Networks and all policies in every kind of home."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from jsonargparse import Namespace

from nep.players.checkpoints import CONFIG, load_config
from nep.players.contestants import Checkpoint, MakePolicy
from nep.report.model_card import make_card
from sgm.files import write_whole
from tools.bench.columns import make_network_table, make_table
from tools.bench.comparisons import compare_with_rules, count_decided, make_overview
from tools.bench.home_games import choose_games, list_recorded, list_simulated
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, describe_made, list_table_options
from tools.bench.task_game import TaskGame

_ABOUT_FIRST = ", the first one is compared with the best rule"
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


class AnyHome(TableSuite[TaskGame]):
    """The first network beside the best rule in every kind of home."""

    command = "tools.bench any_home"
    summary = "Play all policies and some networks in every kind of home, and write a table."

    shows_all = True
    options = (
        *list_table_options("any_home.md", ("any_home",), _ABOUT_FIRST),
        Option("card", None, "exported folder whose card gets the overview", type=Path | None),
        Option("recorded", (), "folders of recorded homes"),
        Option("kinds", None, "names of kinds; all if left out", type=tuple[str, ...] | None),
        Option("num_homes", 30, "homes of each simulated kind", low=1),
        Option("steps", 100, "time steps in each of these", low=1),
        Option("searches", 50, "searches in each of these", low=1),
    )

    def check(self, options: Namespace) -> None:
        """Check the card, before hours of playing."""
        if options.card is not None:
            load_config(options.card)

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, TaskGame]:
        """List the kinds of homes."""
        known = dict(list_simulated(options.num_homes, options.steps, options.searches))
        if options.recorded:
            seeds = tuple(range(_RECORDED_SEEDS))
            known |= list_recorded(options.recorded, _RECORDED_SEARCHES, seeds, options.called)
        return choose_games(known, options.kinds)

    def list_players(
        self, options: Namespace, game: TaskGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, MakePolicy]:
        """List the policies that can play there, and the networks."""
        return game.list_players(checkpoints)

    def write(self, report: Report) -> list[str]:
        """Return the overview, networks side by side, and a table of each kind."""
        about, scores, networks = report.about, report.scores, report.networks
        titles = {name: told["title"] for name, told in about.items()}
        overview = make_overview(about, scores, networks[0])
        parts = [
            "# One network in homes of every kind",
            f"`{report.command}`. NLL, calibration error and looks: less is better.",
            f"## `{networks[0]}` beside the best rule\n\n{overview}",
        ]
        if len(networks) > 1:
            beside = make_network_table(titles, scores, networks)
            parts.append(f"## The networks\n\n{_ABOUT_NETWORKS}\n\n{beside}")
        for name, title in titles.items():
            parts.append(f"## {title}\n\n{make_table(scores[name])}")
        parts.append(describe_made(report.cache, report.shown, networks))
        if report.options.card is not None:
            note_kinds(report.options.card, overview)
        print(count_decided(about, compare_with_rules(about, scores, networks[0])))
        return parts


main = AnyHome().main

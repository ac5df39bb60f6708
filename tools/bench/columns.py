"""Columns of the tables of games, and tables of means: players, and networks side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from nep.report.tables import join_table
from simulator.policies.registry import ORACLES, POLICIES
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from tools.bench.task_game import GameScores

# Policies that a robot could follow: they do not know the true home.
RULES = tuple(name for name in POLICIES if name not in ORACLES)

# What a player did, as metrics: in these tables some have other headings.
COLUMNS = {
    column.name: column
    for column in (
        replace(METRICS["accuracy"], title="first guess"),
        METRICS["nll"],
        replace(METRICS["calibration_error"], title="calibration error"),
        replace(STEP_METRICS["looks"], title="looks until found"),
        METRICS["away_accuracy"],
        METRICS["out_of_place_accuracy"],
    )
}
COMPARED = ("accuracy", "nll", "looks")  # those with a number of every home
_BESIDE = ("accuracy", "nll", "calibration_error", "looks")


def format_mean(name: str, values: Sequence[float] | np.ndarray) -> str:
    """Write the mean of a column."""
    return format(float(np.mean(values)), COLUMNS[name].format)


def make_network_table(
    titles: Mapping[str, str], scores: GameScores, networks: Sequence[str]
) -> str:
    """Return a Markdown table with one row per kind: networks beside each other."""
    rows = []
    for game, title in titles.items():
        found = [scores[game][network] for network in networks]
        means = ([format_mean(name, score[name]) for name in _BESIDE] for score in found)
        rows.append([title, *map(" / ".join, means)])
    return join_table(["homes", *networks], rows)


def make_table(scores: Mapping[str, Mapping[str, Sequence[float]]]) -> str:
    """Return the Markdown table of one kind, the best first guess last.

    Columns that some player lacks are left out, such as looks where there is no search.
    """
    shown = [name for name in COLUMNS if all(name in by_player for by_player in scores.values())]
    order = sorted(scores, key=lambda player: float(np.mean(scores[player]["accuracy"])))
    rows = [
        [player, *(format_mean(name, scores[player][name]) for name in shown)] for player in order
    ]
    return join_table(["who", *(COLUMNS[name].title for name in shown)], rows)


def make_accuracy_table(scores: GameScores) -> str:
    """Return a Markdown table of the share of right first guesses: players by kinds."""
    players = dict.fromkeys(player for by_player in scores.values() for player in by_player)
    rows = []
    for player in players:
        played = [
            by_player[player]["accuracy"] if player in by_player else None
            for by_player in scores.values()
        ]
        rows.append(
            [player, *("" if values is None else f"{np.mean(values):.3f}" for values in played)]
        )
    return join_table(["who", *scores], rows)


def find_best_rule(
    scores: Mapping[str, Mapping[str, Sequence[float] | np.ndarray]], column: Metric
) -> str:
    """Return the rule that does best in a column, of those that have played."""
    played = [player for player in scores if player in RULES]
    sign = 1 if column.is_higher_better else -1
    return max(played, key=lambda player: sign * float(np.mean(scores[player][column.name])))

"""Tables of kinds of homes: every player, and networks beside each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nep.kinds.play import Scores
from nep.report.tables import join_table
from simulator.policies.registry import ORACLES, POLICIES

# Policies that a robot could follow: they do not know the true home.
RULES = tuple(name for name in POLICIES if name not in ORACLES)

# Column, heading, format, and whether a high value is a good one.
COLUMNS = (
    ("accuracy", "first guess", ".3f", True),
    ("nll", "NLL", ".2f", False),
    ("calibration_error", "calibration error", ".3f", False),
    ("looks", "looks until found", ".2f", False),
    ("away_accuracy", "right if away", ".3f", True),
    ("out_of_place_accuracy", "right if out of place", ".3f", True),
)
_BESIDE = tuple(
    column for column in COLUMNS if column[0] in ("accuracy", "nll", "calibration_error", "looks")
)


def make_network_table(titles: Mapping[str, str], scores: Scores, networks: Sequence[str]) -> str:
    """Return a Markdown table with one row per kind: networks beside each other.

    Args:
        titles: of the kinds, by name.
        scores: of all players.
        networks: which ones.
    """
    rows = []
    for kind, title in titles.items():
        own = [scores[kind][network] for network in networks]
        means = ([format(np.mean(one[name]), form) for name, _, form, _ in _BESIDE] for one in own)
        rows.append([title, *map(" / ".join, means)])
    return join_table(["homes", *networks], rows)


def make_table(scores: Mapping[str, Mapping[str, Sequence[float]]]) -> str:
    """Return the Markdown table of one kind, the best first guess last.

    Columns that some player lacks are left out, such as looks where nobody searches.
    """
    shown = [column for column in COLUMNS if all(column[0] in own for own in scores.values())]
    means = {
        player: {name: float(np.mean(columns[name])) for name, *_ in shown}
        for player, columns in scores.items()
    }
    order = sorted(means, key=lambda player: means[player]["accuracy"])
    rows = [[player, *(format(means[player][c[0]], c[2]) for c in shown)] for player in order]
    return join_table(["who", *(heading for _, heading, _, _ in shown)], rows)


def make_accuracy_table(scores: Scores) -> str:
    """Return a Markdown table of the share of right first guesses: players by kinds."""
    players = dict.fromkeys(player for own in scores.values() for player in own)
    rows = []
    for player in players:
        played = [own[player]["accuracy"] if player in own else None for own in scores.values()]
        rows.append(
            [player, *("" if values is None else f"{np.mean(values):.3f}" for values in played)]
        )
    return join_table(["who", *scores], rows)


def find_best_rule(
    scores: Mapping[str, Mapping[str, Sequence[float]]], column: tuple[str, str, str, bool]
) -> str:
    """Return the rule that does best in a column.

    Args:
        scores: of all players of a kind.
        column: which one.
    """
    name, _, _, is_high = column
    rules = [player for player in scores if player in RULES]
    sign = 1 if is_high else -1
    return max(rules, key=lambda player: sign * float(np.mean(scores[player][name])))

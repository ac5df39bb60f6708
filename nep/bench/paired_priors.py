"""Priors beside each other: what one gives to a player that another does not, home by home."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from nep.bench.columns import COLUMNS, COMPARED, lay_out_by_column, list_difference_columns
from nep.bench.task_game import GameScores
from nep.report.statistics import correct_holm
from nep.report.tables import Difference, TableColumn, format_p
from simulator.tasks.metrics import Metric

_ABOUT = """\
The same player with one prior, minus itself with another, in the same homes. A home is the unit:
all plays of one are averaged first. *Holm* is p corrected for all {number} comparisons of this
section; bold: decided after it. What is asked for may differ a little with the prior, since it says
how often things move ([ruling 9](../docs/design.md#rulings))."""


@dataclass(frozen=True, slots=True)
class PriorDifference:
    """A player with two priors, by one column.

    Attributes:
        column: what is compared.
        player: who plays with both.
        first, second: names of the priors.
        homes: what their kinds have in common, such as "episodes-policy".
        difference: with the first minus with the second.
        corrected: p after Holm's correction.
    """

    column: Metric
    player: str
    first: str
    second: str
    homes: str
    difference: Difference
    corrected: float = float("nan")


def compare_priors(
    about: Mapping[str, Mapping[str, Any]],
    scores: GameScores,
    further: Sequence[str],
    players: Sequence[str],
) -> list[PriorDifference]:
    """Compare each further prior with every other one that a player had in the same homes.

    The name of a kind ends with its prior. A player that has not played there is left out.
    """
    by_homes: dict[str, dict[str, str]] = {}
    for kind in about:
        homes, _, prior = kind.rpartition("-")
        by_homes.setdefault(homes, {})[prior] = kind
    pairs = [
        (homes, first, second)
        for homes, kinds in by_homes.items()
        for number, first in enumerate(further)
        for second in kinds
        if first in kinds and second not in further[number:]
    ]
    found = []
    for column, player, (homes, first, second) in product(COMPARED, players, pairs):
        kinds = by_homes[homes]
        own = [scores[kinds[prior]].get(player, {}) for prior in (first, second)]
        if any(column not in one for one in own):
            continue
        values = np.subtract(*(np.array(one[column]) for one in own))
        difference = Difference.of(values, about[kinds[first]]["units"])
        found.append(PriorDifference(COLUMNS[column], player, first, second, homes, difference))
    corrected = correct_holm([row.difference.p for row in found])
    return [replace(row, corrected=p) for row, p in zip(found, corrected, strict=True)]


def make_comparison(rows: Sequence[PriorDifference]) -> str:
    """Return Markdown: what is compared, and a table for each column."""

    def list_columns(form: str) -> list[TableColumn]:
        return [
            TableColumn("homes", lambda row: row.homes),
            TableColumn("player", lambda row: f"`{row.player}`"),
            TableColumn("prior", lambda row: f"{row.first} minus {row.second}"),
            *list_difference_columns(form),
            TableColumn("p", lambda row: format_p(row.difference.p)),
            TableColumn("Holm", lambda row: format_p(row.corrected)),
        ]

    columns = dict.fromkeys(row.column.name for row in rows)
    tables = lay_out_by_column(rows, columns, list_columns, num_text=3)
    return "\n\n".join([_ABOUT.format(number=len(rows)), *tables])

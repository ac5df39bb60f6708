"""Comparisons in the tables of games: a network and the best rule, a player with two priors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from nep.report.statistics import LEVEL
from nep.report.tables import (
    Difference,
    TableColumn,
    correct_rows,
    format_difference,
    format_number,
    format_p,
    join_table,
    lay_out,
)
from simulator.tasks.metrics import Metric
from tools.bench.columns import COLUMNS, COMPARED, find_best_rule
from tools.bench.task_game import GameScores

_ABOUT_RULES = """\
A rule is any policy that does not know the true home. The one that does best in these homes is
compared, which favours the rule. Units are homes, or households: all plays of one are averaged
first. Intervals are bootstrapped over units; where there are fewer than ten, they are t intervals.
*Detectable* is the smallest true difference that would be found with 80 % power. *p* is that of a
paired t test. *Holm* is the same, corrected for all comparisons of these tables. Bold: decided
after the correction."""
_ABOUT_PRIORS = """\
The same player with one prior, minus itself with another, in the same homes. A home is the unit:
all plays of one are averaged first. *Holm* is p corrected for all {number} comparisons of this
section; bold: decided after it. What is asked for may differ a little with the prior, since it says
how often things move ([ruling 9](../docs/design.md#rulings))."""


@dataclass(frozen=True, slots=True)
class RuleComparison:
    """A network and the best rule in one kind of homes, by one column.

    Attributes:
        game: name of the homes.
        column: what is compared.
        network_mean: mean score of the network.
        rule: the best one.
        rule_mean: mean score of that rule.
        num_units: homes or households.
        difference: network minus rule.
        corrected: p after Holm's correction; nan if this is the same play as `same_as`.
        same_as: game of an earlier comparison of the very same scores; it counts once.
    """

    game: str
    column: Metric
    network_mean: float
    rule: str
    rule_mean: float
    num_units: int
    difference: Difference
    corrected: float = float("nan")
    same_as: str | None = None

    @property
    def is_ahead(self) -> bool:
        """Whether the network is the better one, by however little."""
        sign = 1 if self.column.is_higher_better else -1
        return sign * self.difference.mean > 0


def compare_with_rules(
    about: Mapping[str, Mapping[str, Any]], scores: GameScores, network: str
) -> list[RuleComparison]:
    """Compare a network with the best rule in every kind of homes, by every column.

    `about` has the units of each game, see `Game.tell`.
    """
    found: list[RuleComparison] = []
    for column in map(COLUMNS.__getitem__, COMPARED):
        seen: dict[tuple[bytes, str, bytes], str] = {}
        for game, told in about.items():
            if column.name not in scores[game][network]:  # looks, where there is no search
                continue
            rule = find_best_rule(scores[game], column)
            first, second = (np.array(scores[game][who][column.name]) for who in (network, rule))
            same_as = seen.setdefault((first.tobytes(), rule, second.tobytes()), game)
            found.append(
                RuleComparison(
                    game,
                    column,
                    float(first.mean()),
                    rule,
                    float(second.mean()),
                    len(set(told["units"])),
                    Difference.of(first - second, told["units"]),
                    same_as=None if same_as == game else same_as,
                )
            )
    return correct_rows(found)


def count_decided(about: Mapping[str, Mapping[str, Any]], rows: Sequence[RuleComparison]) -> str:
    """Say in how many comparisons a network, or a rule, is ahead, and in how many by chance."""
    counted = [row for row in rows if row.same_as is None]
    parts = {
        "all": counted,
        "in simulated homes": [row for row in counted if not about[row.game]["is_recorded"]],
        "in households": [row for row in counted if about[row.game]["is_recorded"]],
    }
    lines = []
    for name, part in parts.items():
        if not part or (name != "all" and len(part) == len(counted)):
            continue
        decided = [row for row in part if row.difference.p < 1 - LEVEL]
        corrected = [row for row in part if row.corrected < 1 - LEVEL]
        counts = [
            str(sum(row.is_ahead == ahead for row in group))
            for group in (decided, corrected)
            for ahead in (True, False)
        ]
        chance = len(part) * (1 - LEVEL) / 2
        lines.append([name, str(len(part)), *counts[:2], f"{chance:.1f}", *counts[2:]])
    header = [
        "comparisons",
        "number",
        "network ahead, p < .05",
        "rule ahead, p < .05",
        "of either by chance",
        "network ahead, Holm",
        "rule ahead, Holm",
    ]
    text = join_table(header, lines)
    if again := len(rows) - len(counted):
        text += f"\n{again} more rows are the very plays of another row, and count once.\n"
    return text


def make_overview(about: Mapping[str, Mapping[str, Any]], scores: GameScores, network: str) -> str:
    """Return Markdown tables with one row per kind, a table per column, and what is decided."""
    rows = compare_with_rules(about, scores, network)

    def write_p(row: RuleComparison) -> str:
        return "the same plays" if row.same_as else format_p(row.difference.p)

    def write_corrected(row: RuleComparison) -> str:
        return f"as {about[row.same_as]['title']}" if row.same_as else format_p(row.corrected)

    def list_columns(form: str) -> list[TableColumn]:
        return [
            TableColumn("homes", lambda row: about[row.game]["title"]),
            TableColumn("units", lambda row: str(row.num_units)),
            TableColumn(network, lambda row: format(row.network_mean, form)),
            TableColumn("best rule", lambda row: f"{row.rule_mean:{form}} {row.rule}"),
            *list_difference_columns(form),
            TableColumn("p", write_p),
            TableColumn("Holm", write_corrected),
        ]

    tables = lay_out_by_column(rows, COMPARED, list_columns)
    return "\n\n".join([_ABOUT_RULES, count_decided(about, rows).strip(), *tables]) + "\n"


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
    for game in about:
        homes, _, prior = game.rpartition("-")
        by_homes.setdefault(homes, {})[prior] = game
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
        pair = [scores[kinds[prior]].get(player, {}) for prior in (first, second)]
        if any(column not in score for score in pair):
            continue
        values = np.subtract(*(np.array(score[column]) for score in pair))
        difference = Difference.of(values, about[kinds[first]]["units"])
        found.append(PriorDifference(COLUMNS[column], player, first, second, homes, difference))
    return correct_rows(found)


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
    return "\n\n".join([_ABOUT_PRIORS.format(number=len(rows)), *tables])


def list_difference_columns(form: str) -> list[TableColumn]:
    """List the columns of a `difference`, bold where it is decided after Holm's correction."""

    def write_difference(row: Any) -> str:
        mark = "**" if row.corrected < 1 - LEVEL else ""
        return f"{mark}{format_difference(row.difference, form)}{mark}"

    return [
        TableColumn("difference [95 %]", write_difference),
        TableColumn("detectable", lambda row: format_number(row.difference.detectable, form)),
    ]


def lay_out_by_column(
    rows: Sequence[Any],
    names: Iterable[str],
    list_columns: Callable[[str], list[TableColumn]],
    num_text: int = 1,
) -> list[str]:
    """Make a Markdown table of the rows of each `column`, under its title.

    Args:
        rows: comparisons.
        names: of the columns that are compared.
        list_columns: lists the columns of a table, from the format of its numbers.
        num_text: columns that are text.
    """
    parts = []
    for column in map(COLUMNS.__getitem__, names):
        shown = [row for row in rows if row.column == column]
        better = "more" if column.is_higher_better else "less"
        title = column.title[:1].upper() + column.title[1:]
        table = lay_out(shown, list_columns(column.format), num_text)
        parts.append(f"### {title} ({better} is better)\n\n{table.strip()}")
    return parts

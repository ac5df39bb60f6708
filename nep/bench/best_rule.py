"""A network beside the best rule in every kind of homes: what is decided, and how surely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nep.bench.columns import (
    COLUMNS,
    COMPARED,
    find_best_rule,
    lay_out_by_column,
    list_difference_columns,
)
from nep.bench.task_game import GameScores
from nep.report.statistics import LEVEL, correct_holm
from nep.report.tables import Difference, TableColumn, format_p, join_table
from simulator.tasks.metrics import Metric

_ABOUT = """\
A rule is any policy that does not know the true home. The one that does best in these homes is
compared, which favours the rule. Units are homes, or households: all plays of one are averaged
first. Intervals are bootstrapped over units; where there are fewer than ten, they are t intervals.
*Detectable* is the smallest true difference that would be found with 80 % power. *p* is that of a
paired t test. *Holm* is the same, corrected for all comparisons of these tables. Bold: decided
after the correction."""


@dataclass(frozen=True, slots=True)
class RuleComparison:
    """A network and the best rule in one kind of homes, by one column.

    Attributes:
        kind: name of the homes.
        column: what is compared.
        own: mean of the network.
        rule: which one is the best.
        other: its mean.
        num_units: homes or households.
        difference: network minus rule.
        corrected: p after Holm's correction; nan if this is the same play as `same_as`.
        same_as: kind of an earlier comparison of the very same scores; it counts once.
    """

    kind: str
    column: Metric
    own: float
    rule: str
    other: float
    num_units: int
    difference: Difference
    corrected: float = float("nan")
    same_as: str | None = None

    @property
    def is_ahead(self) -> bool:
        """Whether the network is the better one, by however little."""
        return (
            self.difference.mean > 0
        ) == self.column.is_higher_better and self.difference.mean != 0


def compare_with_rules(
    about: Mapping[str, Mapping[str, Any]], scores: GameScores, network: str
) -> list[RuleComparison]:
    """Compare a network with the best rule in every kind of homes, by every column.

    `about` has the units of each kind, see `Game.tell`.
    """
    found: list[RuleComparison] = []
    for column in map(COLUMNS.__getitem__, COMPARED):
        seen: dict[tuple[bytes, str, bytes], str] = {}
        for kind, own in about.items():
            if column.name not in scores[kind][network]:  # looks, where there is no search
                continue
            rule = find_best_rule(scores[kind], column)
            first, second = (np.array(scores[kind][who][column.name]) for who in (network, rule))
            same_as = seen.setdefault((first.tobytes(), rule, second.tobytes()), kind)
            found.append(
                RuleComparison(
                    kind, column, float(first.mean()), rule, float(second.mean()),
                    len(set(own["units"])), Difference.of(first - second, own["units"]),
                    same_as=None if same_as == kind else same_as,
                )
            )  # fmt: skip
    counted = [row for row in found if row.same_as is None]
    corrected = iter(correct_holm([row.difference.p for row in counted]))
    return [
        replace(row, corrected=next(corrected)) if row.same_as is None else row for row in found
    ]


def count_decided(about: Mapping[str, Mapping[str, Any]], rows: Sequence[RuleComparison]) -> str:
    """Say in how many comparisons a network, or a rule, is ahead, and in how many by chance."""
    counted = [row for row in rows if row.same_as is None]
    parts = {
        "all": counted,
        "in simulated homes": [row for row in counted if not about[row.kind]["is_recorded"]],
        "in households": [row for row in counted if about[row.kind]["is_recorded"]],
    }
    lines = []
    for name, part in parts.items():
        if not part or (name != "all" and len(part) == len(counted)):
            continue
        decided = [[row for row in part if row.difference.p < 1 - LEVEL]]
        decided.append([row for row in part if row.corrected < 1 - LEVEL])
        ahead = [sum(row.is_ahead for row in group) for group in decided]
        behind = [len(group) - num for group, num in zip(decided, ahead, strict=True)]
        chance = len(part) * (1 - LEVEL) / 2
        lines.append(
            [name, *map(str, (len(part), ahead[0], behind[0])), f"{chance:.1f}",
             *map(str, (ahead[1], behind[1]))]
        )  # fmt: skip
    header = [
        "comparisons", "number", "network ahead, p < .05", "rule ahead, p < .05",
        "of either by chance", "network ahead, Holm", "rule ahead, Holm",
    ]  # fmt: skip
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
            TableColumn("homes", lambda row: about[row.kind]["title"]),
            TableColumn("units", lambda row: str(row.num_units)),
            TableColumn(network, lambda row: format(row.own, form)),
            TableColumn("best rule", lambda row: f"{row.other:{form}} {row.rule}"),
            *list_difference_columns(form),
            TableColumn("p", write_p),
            TableColumn("Holm", write_corrected),
        ]

    tables = lay_out_by_column(rows, COMPARED, list_columns)
    return "\n\n".join([_ABOUT, count_decided(about, rows).strip(), *tables]) + "\n"

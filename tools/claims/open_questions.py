"""The sections of `results/claims.md` about what the paper's text leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from nep.bench.paper.experiments import SETTINGS
from nep.bench.paper.paper_numbers import PAPER_TABLE_1
from nep.report.tables import join_table
from tools.claims.plan import LIKELIHOOD, ORDER, PAPER_POLICIES, SOURCES
from tools.claims.readings import READINGS
from tools.claims.scores import ClaimsScores, round_all

# Rows of the paper's likelihood column that no reading comes near.
_UNEXPLAINED = ("myopic", "oracle")


def make_readings(scores: ClaimsScores) -> tuple[str, Any]:
    """Score the likelihood task under several readings of its metric."""
    names = (*PAPER_POLICIES, "ceiling", *ORDER.values())
    lines = []
    kept: dict[str, Any] = {}
    for nodes in LIKELIHOOD:
        column = {
            name: numbers[0] for name, numbers in PAPER_TABLE_1[LIKELIHOOD[nodes].name].items()
        }
        paper = [f"{column[name]:.3f}" if name in column else "" for name in names]
        lines.append([f"*the paper, {nodes}*", *paper, "", "", ""])
        for source, where in SOURCES.items():
            means = scores.load_readings(source, nodes)
            kept[f"{source}-{nodes}"] = {
                name: round_all(by_reading) for name, by_reading in means.items()
            }
            for key, reading in READINGS.items() if means else ():
                ours = {name: means[name][key] for name in names if name in means}
                cells = [f"{ours[name]:.3f}" if name in ours else "" for name in names]
                away = {name: abs(ours[name] - column[name]) for name in ours if name in column}
                others = [value for name, value in away.items() if name not in _UNEXPLAINED]
                lines.append(
                    [
                        f"{where}, {nodes}: {reading.title}",
                        *cells,
                        f"{np.mean([*away.values()]):.3f}",
                        f"{np.mean(others):.3f}",
                        _count_order(ours, column),
                    ]
                )
    header = ["a place counts", *names, "off by", "but for two", "pairs alike"]
    text = [
        "## What the likelihood metric can have been\n",
        "Predict Relative Location Likelihood: NDCG of the same rankings under several "
        "readings; the first is ours ([ruling 17](../docs/design.md#rulings)). Networks "
        f"were trained for Predict Object Location (seed {scores.plan.switch_seed}). Off "
        "by: mean distance to the paper's column over the rows that were played, then "
        f"without {' and '.join(_UNEXPLAINED)}, which no reading gives; pairs alike: share "
        "of pairs of rows in the paper's order.\n",
        join_table(header, lines),
    ]
    return "\n".join(text), kept


def make_rooms(scores: ClaimsScores) -> tuple[str, Any]:
    """Let objects move within a room, or over the whole home."""
    lines = []
    names = PAPER_POLICIES
    kept: dict[str, Any] = {}
    for setting in SETTINGS:
        column = PAPER_TABLE_1[setting.name]
        lines.append(
            [f"*{setting.title}: the paper*"]
            + [f"{column[name][0]:.3f}" if name in column else "" for name in names]
            + [""]
        )
        for crosses in (False, True):
            found = {name: scores.load("sampled", setting, name, crosses) for name in names}
            means = {n: float(s.home_values.mean()) for n, s in found.items() if s is not None}
            kept.setdefault(setting.name, {})["home" if crosses else "room"] = round_all(means)
            both = [name for name in means if name in column]
            away = [abs(means[name] - column[name][0]) for name in both]
            away = away if len(both) == len(names) else []  # of all, or of none
            lines.append(
                ["over the whole home" if crosses else "within the room"]
                + [f"{means[name]:.3f}" if name in means else "" for name in names]
                + [f"{np.mean(away):.3f}" if away else ""]
            )
    text = [
        "## Moves within a room, or over the whole home\n",
        "The paper is silent; [ruling 2](../docs/design.md#rulings) keeps an object in its "
        "room. Homes of 32 places. "
        "Off by: mean distance to the paper's column. Grades within reach are a reading of "
        "the table above.\n",
        join_table(["moves", *names, "off by"], lines),
    ]
    return "\n".join(text), kept


def _count_order(ours: Mapping[str, float], theirs: Mapping[str, float]) -> str:
    """Return the share of pairs that both order alike, of those whom both know."""
    pairs = combinations(ours.keys() & theirs.keys(), 2)
    alike = [(ours[a] - ours[b]) * (theirs[a] - theirs[b]) > 0 for a, b in pairs]
    return f"{np.mean(alike):.0%}" if alike else ""

"""The section of `results/claims.md` about adaptation: first steps in a home against the last."""

from __future__ import annotations

from typing import Any

import numpy as np

from nep.report.results import ScoreSummary, unpack_summary
from nep.report.tables import Difference, format_difference, join_table
from tools.claims.plan import LOCATION, ORDER, ClaimsPlan
from tools.claims.scores import ClaimsScores

NUM_STEPS = 10  # at either end of an episode
_WITHOUT_NETWORKS = (
    " In homes of 32 places networks have no rows, and GCN has none in 24: of these trainings "
    "Table 1 has the means of homes, not of steps. Six trainings would have to be made again for "
    "what the homes of 24 places show."
)
_POLICIES = ("bayesian", "adaptive", "persistence", "oracle")


def make_adaptation(scores: ClaimsScores) -> tuple[str, Any]:
    """Compare accuracy in the first steps with that in the last, in homes of 32 places."""
    plan = scores.plan
    num = min(NUM_STEPS, plan.steps // 2)
    lines, kept = [], {}
    for nodes in LOCATION if num else ():
        for title, values in _load_steps(scores, nodes).items():
            first, last = values[:, :num].mean(axis=1), values[:, -num:].mean(axis=1)
            gain = Difference.of(last - first)
            kept[f"{nodes}, {title}"] = [round(float(part.mean()), 4) for part in (first, last)]
            lines.append(
                [
                    nodes,
                    title,
                    f"{first.mean():.3f}",
                    f"{last.mean():.3f}",
                    format_difference(gain, ".3f"),
                ]
            )
    unplayed = {line.partition(", steps, ")[0] for line in scores.missing}
    reason = _WITHOUT_NETWORKS if unplayed.issuperset(ORDER.values()) else ""
    header = ["objects come and go", "method", f"first {num} steps", f"last {num}", "gain [95 %]"]
    text = [
        "## Adaptation: first steps against last\n",
        "The paper's headline is that networks adapt to a home as its memory fills. Predict Object "
        "Location, 32 places: accuracy in the first and the last steps, paired over homes. A gain "
        "shows that a method learns from its looks. Rules gain, too, without any training. In "
        "homes of 24 places the networks gain as much: where objects stay, MLP from 0.235 to 0.471 "
        "and HEAT from 0.242 to 0.490 (one training each); where they come and go, from 0.254 to "
        "0.437 and from 0.263 to 0.425 (three; "
        "[first steps against last](released_code.md#first-steps-against-last))."
        f"{reason}\n",
        join_table(header, lines, 2),
    ]
    return "\n".join(text), kept


def _load_steps(scores: ClaimsScores, nodes: str) -> dict[str, np.ndarray]:
    """Return the score of every home and step, (H, T), by title: of networks over trainings.

    Of trainings in Table 1 the means of homes are all there is.
    """
    plan, setting = scores.plan, LOCATION[nodes]
    game = plan.make_game("sampled", setting)
    found: dict[str, np.ndarray] = {}
    for name in _POLICIES:
        played = scores.find(game, name)
        if played is not None and _has_steps(unpack_summary(played), plan):
            found[name] = unpack_summary(played).values
        else:
            scores.missing.append(f"{name}, steps, dynamic nodes {nodes}")
    for name, title in ORDER.items():
        trainings = []
        for seed in range(plan.num_seeds):
            training = plan.make_training("sampled", nodes, (name,), seed)
            played = scores.find(game, plan.name_training(training))
            if played is not None and _has_steps(unpack_summary(played), plan):
                trainings.append(unpack_summary(played).values)
        if trainings:
            count = f" ({len(trainings)} trainings)" if len(trainings) > 1 else ""
            found[f"{title}{count}"] = np.mean(trainings, axis=0)
        else:
            scores.missing.append(f"{title}, steps, dynamic nodes {nodes}")
    return found


def _has_steps(summary: ScoreSummary, plan: ClaimsPlan) -> bool:
    return summary.values.shape[1] == plan.steps

"""The section of `results/claims.md` about what can be known without knowing the home."""

from __future__ import annotations

from typing import Any

from nep.report.results import ScoreSummary, unpack_summary
from nep.report.statistics import compute_gap_closed
from nep.report.tables import compute_difference, format_difference, join_table
from simulator.policies import POLICIES
from tools.claims.plan import INFORMED, LOCATION, ORDER, SOURCES
from tools.claims.scores import ClaimsScores, round_all


def make_known(scores: ClaimsScores) -> tuple[str, Any]:
    """Compare all with a policy that is given all rules but not the home."""
    lines = []
    kept: dict[str, Any] = {}
    texts = []
    for source, where in SOURCES.items():
        for nodes in LOCATION:
            informed = scores.find(scores.plan.make_informed(source, nodes), INFORMED)
            if informed is None:
                scores.missing.append(f"{INFORMED}, {where}, dynamic nodes {nodes}")
                continue
            found = _load_all(scores, source, nodes)
            top = found[INFORMED] = unpack_summary(informed)
            sizes = informed["sizes"]
            texts.append(
                f"{where}, {nodes}: an answer has an effective sample size of {sizes[5]:.0f} "
                f"of its 1,024 draws (median), {sizes[1]:.0f} in the worst tenth."
            )
            means = {name: float(summary.home_values.mean()) for name, summary in found.items()}
            for name in sorted(means, key=means.__getitem__):
                share = compute_gap_closed(means[name], means["bayesian"], means[INFORMED])
                difference = None if name == INFORMED else compute_difference(found[name], top)
                lines.append(
                    [
                        f"{where}, {nodes}",
                        name,
                        f"{means[name]:.3f}",
                        f"{share:.0%}",
                        format_difference(difference, ".3f"),
                    ]
                )
            kept[f"{source}-{nodes}"] = {"means": round_all(means), "sizes": sizes}
    header = ["homes", "method", "accuracy", "Bayesian to informed", "minus informed [95 %]"]
    text = [
        "## What can be known\n",
        "`informed` knows all rules but not the home: filters over draws of class and "
        "instance noise, weighed by the likelihood of all looks (`tools.claims."
        "informed`). `oracle` and `ceiling` know the home. Share: of the way from Bayesian "
        "to `informed`.\n",
        "\n".join(texts) + "\n",
        join_table(header, lines, 2),
    ]
    return "\n".join(text), kept


def _load_all(scores: ClaimsScores, source: str, nodes: str) -> dict[str, ScoreSummary]:
    """Return what policies and networks have scored, as far as they have played."""
    plan, setting = scores.plan, LOCATION[nodes]
    found = {}
    for name in POLICIES:
        summary = scores.load(source, setting, name)
        if summary is not None:
            found[name] = summary
    for name, title in ORDER.items():
        trained = scores.load_trainings(source, nodes, (name,), range(plan.num_seeds))
        if trained:
            found[title] = ScoreSummary.join([*trained.values()])
    if plan.is_in_table_1(source, 0):
        found["NEP-HEAT+"] = scores.table_1[setting]["NEP-HEAT+"]
    return found

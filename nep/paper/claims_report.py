"""`results/claims.md` and `claims.json` from what has been played so far."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from nep.paper.claims import (
    INFORMED,
    LIKELIHOOD,
    LOCATION,
    ORDER,
    PAPER_POLICIES,
    SOURCES,
    SWITCHES,
    ClaimsPlan,
    InformedScores,
)
from nep.paper.experiments import SETTINGS, Setting
from nep.paper.paper_numbers import PAPER_TABLE_1
from nep.paper.paper_tables import Claim
from nep.paper.readings import READINGS
from nep.report.results import ScoreSummary, list_versions
from nep.report.statistics import compute_gap_closed
from nep.report.tables import compute_difference, format_difference, join_table
from simulator.policies import POLICIES

_COMMAND = "python -m nep.claims"
# Rows of the paper's likelihood column that no reading comes near.
_UNEXPLAINED = ("myopic", "oracle")


class ClaimsReport:
    """Tables of what was trained and played; what was not is listed at the end."""

    def __init__(self, plan: ClaimsPlan) -> None:
        """Read the scores that are there."""
        self._plan = plan
        self._missing: list[str] = []
        self._content: dict[str, Any] = {}
        self._table_1 = {setting: plan.load_table_1(setting) for setting in SETTINGS}

    def make_files(self) -> dict[str, bytes]:
        """Return the files by name."""
        plan = self._plan
        parts = [
            "# What the paper claims\n",
            f"{plan.num_homes} test homes x {plan.steps} steps, seed 0, the same for all rows; "
            "differences are paired over homes, and over trainings where there are several, with "
            "95 % bootstrap intervals. Nothing here was chosen by its scores in these homes. A "
            "training has the paper's setting (10,000 memories of "
            "100 homes, 25 epochs) unless its row says otherwise.\n",
            self._make_orders(),
            self._make_switches(),
            self._make_known(),
            self._make_readings(),
            self._make_rooms(),
            "## Not run\n",
            "".join(f"- {line}\n" for line in self._missing) or "Nothing is missing.\n",
            self._make_footer(),
        ]
        content = {"command": _COMMAND, "versions": list_versions(), **self._content}
        return {
            "claims.md": "\n".join(parts).encode(),
            "claims.json": (json.dumps(content, indent=1) + "\n").encode(),
        }

    def _load_trainings(
        self, source: str, nodes: str, configs: Sequence[str], seeds: Sequence[int]
    ) -> dict[int, ScoreSummary]:
        """Return the scores of trainings by seed; those that are missing are noted."""
        found = {}
        for seed in seeds:
            name = "-".join(configs)
            if self._plan.is_in_table_1(source, seed) and name in ORDER:
                found[seed] = self._table_1[LOCATION[nodes]][ORDER[name]]
                continue
            own = self._plan.evaluate(self._plan.make_training(source, nodes, configs, seed))
            if own.is_done():  # of Table 1, too, the means of homes are all there is
                found[seed] = ScoreSummary(own.load().home_values[:, None], {})
            else:
                line = f"{name}, {SOURCES[source]}, dynamic nodes {nodes}, seed {seed}"
                self._missing.append(line)
        return found

    def _load(self, source: str, setting: Setting, name: str, crosses: bool = False) -> Any:
        """Return what a policy has scored; None, and a note, if it has not played."""
        if source == "sampled" and not crosses and name in self._table_1[setting]:
            return self._table_1[setting][name]
        own = self._plan.play(source, setting, name, crosses)
        if own.is_done():
            return own.load()
        where = ", moves over the whole home" if crosses else ""
        self._missing.append(f"{name}, {SOURCES[source]}, {setting.title}{where}")
        return None

    def _make_orders(self) -> str:
        cells, lines = [], []
        kept: dict[str, Any] = {}
        for source, where in SOURCES.items():
            for nodes, setting in LOCATION.items():
                seeds = range(self._plan.num_seeds)
                scores = {
                    name: self._load_trainings(source, nodes, (name,), seeds) for name in ORDER
                }
                title = f"{where}, {nodes}"
                row = [title]
                for by_seed in scores.values():
                    means = [float(own.home_values.mean()) for own in by_seed.values()]
                    row.append(_list_means(means))
                cells.append(row)
                kept[f"{source}-{nodes}"] = {
                    name: {seed: _round(own.home_values) for seed, own in by_seed.items()}
                    for name, by_seed in scores.items()
                }
                for worse, better in combinations(ORDER, 2):
                    claim = _compare(setting, scores, better, worse)
                    if claim is not None:
                        number = len(scores[better].keys() & scores[worse].keys())
                        lines.append(
                            [
                                title,
                                f"{claim.better} better than {claim.worse}",
                                str(number),
                                format_difference(claim.difference, ".3f"),
                                claim.verdict,
                            ]
                        )
        self._content["orders"] = kept
        paper = [
            [f"the paper, {nodes}"]
            + [f"{PAPER_TABLE_1[LOCATION[nodes].name][title][0]:.3f}" for title in ORDER.values()]
            for nodes in LOCATION
        ]
        return "\n".join(
            [
                "## HEAT before GCN before MLP?\n",
                "Predict Object Location, share of right first guesses: mean over trainings, in "
                "brackets those of seed 0, 1, ... as far as they were run. *On* and *off* say "
                "whether objects come and go.\n",
                join_table(["homes", *ORDER.values()], [*cells, *paper]),
                "A training draws its homes, weights and batches by its seed. Holds or reversed: "
                "the interval excludes zero.\n",
                join_table(
                    ["homes", "claim", "trainings", "difference [95 %]", "verdict"], lines, 2
                ),
            ]
        )

    def _make_switches(self) -> str:
        seed = self._plan.switch_seed
        plain = {
            name: self._load_trainings("sampled", "on", (name,), [seed]).get(seed) for name in ORDER
        }
        lines = [_make_switch_row("as it is", plain, {})]
        kept = {"as it is": plain}
        for title, by_network in SWITCHES.values():
            changed = {
                name: self._load_trainings("sampled", "on", configs, [seed]).get(seed)
                for name, configs in by_network.items()
            }
            lines.append(_make_switch_row(title, changed, plain))
            kept[title] = changed
        self._content["switches"] = {
            title: {name: _round(own.home_values) for name, own in row.items() if own is not None}
            for title, row in kept.items()
        }
        header = ["change", *ORDER.values(), "GCN minus MLP", "HEAT minus MLP"]
        return "\n".join(
            [
                "## Why: one change at a time\n",
                f"32 places, on, one training each (seed {seed}), so that intervals are over homes "
                "alone. In brackets: minus the same network without the change. Where a change "
                "does not concern NEP-MLP, the last columns compare with NEP-MLP as it is.\n",
                join_table(header, lines),
                "Configs: `no_absence.yaml` (edges count sightings alone), `homes_400.yaml` "
                "(40,000 memories, 6 epochs: as many updates), `gcn_sum.yaml`, `heat_sum.yaml` (a "
                "weight of its own for every edge), `heat_paper.yaml`.\n",
            ]
        )

    def _make_known(self) -> str:
        lines = []
        kept: dict[str, Any] = {}
        texts = []
        for source, where in SOURCES.items():
            for nodes, setting in LOCATION.items():
                informed = InformedScores(self._plan.play(source, setting, INFORMED))
                if not informed.is_done():
                    self._missing.append(f"{INFORMED}, {where}, dynamic nodes {nodes}")
                    continue
                scores: dict[str, ScoreSummary] = {}
                for name in POLICIES:
                    own = self._load(source, setting, name)
                    if own is not None:
                        scores[name] = own
                for name, title in ORDER.items():
                    trained = self._load_trainings(
                        source, nodes, (name,), range(self._plan.num_seeds)
                    )
                    if trained:
                        scores[title] = ScoreSummary.join([*trained.values()])
                if self._plan.is_in_table_1(source, 0):
                    scores["NEP-HEAT+"] = self._table_1[setting]["NEP-HEAT+"]
                top = scores[INFORMED] = informed.evaluation.load()
                sizes = json.loads(informed.sizes_path.read_text())
                texts.append(
                    f"{where}, {nodes}: of its 1,024 draws an answer is worth {sizes[5]:.0f} "
                    f"(median), {sizes[1]:.0f} in the worst tenth."
                )
                means = {name: float(own.home_values.mean()) for name, own in scores.items()}
                for name in sorted(means, key=means.__getitem__):
                    share = compute_gap_closed(means[name], means["bayesian"], means[INFORMED])
                    difference = None if name == INFORMED else compute_difference(scores[name], top)
                    lines.append(
                        [
                            f"{where}, {nodes}",
                            name,
                            f"{means[name]:.3f}",
                            f"{share:.0%}",
                            format_difference(difference, ".3f"),
                        ]
                    )
                kept[f"{source}-{nodes}"] = {"means": _round_all(means), "sizes": sizes}
        self._content["known"] = kept
        header = ["homes", "method", "accuracy", "Bayesian to informed", "minus informed [95 %]"]
        return "\n".join(
            [
                "## What can be known\n",
                "`informed` knows all rules but not the home: filters over draws of class and "
                "instance noise, weighed by the likelihood of all looks (`simulator.policies."
                "informed`). `oracle` and `ceiling` know the home. Share: of the way from Bayesian "
                "to `informed`.\n",
                "\n".join(texts) + "\n",
                join_table(header, lines, 2),
            ]
        )

    def _make_readings(self) -> str:
        names = (*PAPER_POLICIES, "ceiling", *ORDER.values())
        lines = []
        kept: dict[str, Any] = {}
        for nodes in LIKELIHOOD:
            column = {name: row[0] for name, row in PAPER_TABLE_1[LIKELIHOOD[nodes].name].items()}
            paper = [f"{column[name]:.3f}" if name in column else "" for name in names]
            lines.append([f"*the paper, {nodes}*", *paper, "", "", ""])
            for source, where in SOURCES.items():
                means = self._load_readings(source, nodes)
                kept[f"{source}-{nodes}"] = {name: _round_all(own) for name, own in means.items()}
                for key, reading in READINGS.items() if means else ():
                    ours = {name: means[name][key] for name in names if name in means}
                    cells = [f"{ours[name]:.3f}" if name in ours else "" for name in names]
                    away = {name: abs(ours[name] - column[name]) for name in ours if name in column}
                    rest = [value for name, value in away.items() if name not in _UNEXPLAINED]
                    lines.append(
                        [
                            f"{where}, {nodes}: {reading.title}",
                            *cells,
                            f"{np.mean([*away.values()]):.3f}",
                            f"{np.mean(rest):.3f}",
                            _count_order(ours, column),
                        ]
                    )
        self._content["readings"] = kept
        header = ["a place counts", *names, "off by", "but for two", "pairs alike"]
        return "\n".join(
            [
                "## What the likelihood metric can have been\n",
                "Predict Relative Location Likelihood: NDCG of the same rankings under several "
                "readings; the first is ours ([ruling 17](../docs/design.md#rulings)). Networks "
                f"were trained for Predict Object Location (seed {self._plan.switch_seed}). Off "
                "by: mean distance to the paper's column over the rows that were played, then "
                f"without {' and '.join(_UNEXPLAINED)}, which no reading gives; pairs alike: share "
                "of pairs of rows in the paper's order.\n",
                join_table(header, lines),
            ]
        )

    def _load_readings(self, source: str, nodes: str) -> dict[str, dict[str, float]]:
        """Return the mean under every reading by contestant; those that are missing are noted."""
        plan = self._plan
        played = {name: plan.read(source, nodes, name) for name in (*PAPER_POLICIES, "ceiling")}
        for name, title in ORDER.items():
            training = plan.make_training(source, nodes, (name,), plan.switch_seed)
            played[title] = plan.read_network(training)
        found = {}
        for name, own in played.items():
            if own.is_done():
                found[name] = {key: float(values.mean()) for key, values in own.load().items()}
            else:
                self._missing.append(f"{name}, readings, {SOURCES[source]}, dynamic nodes {nodes}")
        return found

    def _make_rooms(self) -> str:
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
                found = {name: self._load("sampled", setting, name, crosses) for name in names}
                means = {n: float(s.home_values.mean()) for n, s in found.items() if s is not None}
                kept.setdefault(setting.name, {})["home" if crosses else "room"] = _round_all(means)
                both = [name for name in means if name in column]
                away = [abs(means[name] - column[name][0]) for name in both]
                away = away if len(both) == len(names) else []  # of all, or of none
                lines.append(
                    ["over the whole home" if crosses else "within the room"]
                    + [f"{means[name]:.3f}" if name in means else "" for name in names]
                    + [f"{np.mean(away):.3f}" if away else ""]
                )
        self._content["rooms"] = kept
        return "\n".join(
            [
                "## Moves within a room, or over the whole home\n",
                "The paper is silent; [ruling 2](../docs/design.md#rulings) keeps an object in its "
                "room. Homes of 32 places. "
                "Off by: mean distance to the paper's column. Grades within reach are a reading of "
                "the table above.\n",
                join_table(["moves", *names, "off by"], lines),
            ]
        )

    def _make_footer(self) -> str:
        notes = []
        if self._plan.table_1 is not None:
            notes.append(
                "Seed 0 in homes of 32 places is that of [table_1.md](table_1.md), which was "
                "played in the same test homes (checked by `bayesian`, home by home)."
            )
        versions = ", ".join(f"{name} {number}" for name, number in list_versions().items())
        return "\n".join(["", *notes, "", f"```\n{_COMMAND}\n```\n\n{versions}.\n"])


def _compare(
    setting: Setting, scores: Mapping[str, Mapping[int, ScoreSummary]], better: str, worse: str
) -> Claim | None:
    """Compare two networks over the seeds that both have; None without any."""
    seeds = sorted(scores[better].keys() & scores[worse].keys())
    if not seeds:
        return None
    first, second = (
        ScoreSummary.join([scores[name][seed] for seed in seeds]) for name in (better, worse)
    )
    return Claim(setting, ORDER[better], ORDER[worse], compute_difference(first, second))


def _make_switch_row(
    title: str,
    changed: Mapping[str, ScoreSummary | None],
    plain: Mapping[str, ScoreSummary | None],
) -> list[str]:
    row = [title]
    for name in ORDER:
        own, before = changed.get(name), plain.get(name)
        cell = "" if own is None else f"{own.home_values.mean():.3f}"
        if own is not None and before is not None:
            cell += f" ({format_difference(compute_difference(own, before), '.3f')})"
        row.append(cell)
    base = changed.get("mlp") if "mlp" in changed else plain.get("mlp")
    for name in ("gcn", "heat"):
        own = changed.get(name)
        both = None if own is None or base is None else compute_difference(own, base)
        row.append(format_difference(both, ".3f"))
    return row


def _list_means(means: Sequence[float]) -> str:
    if not means:
        return ""
    return f"{np.mean(means):.3f} ({', '.join(f'{mean:.3f}' for mean in means)})"


def _count_order(ours: Mapping[str, float], theirs: Mapping[str, float]) -> str:
    """Return the share of pairs that both order alike, of those whom both know."""
    pairs = combinations(ours.keys() & theirs.keys(), 2)
    alike = [(ours[a] - ours[b]) * (theirs[a] - theirs[b]) > 0 for a, b in pairs]
    return f"{np.mean(alike):.0%}" if alike else ""


def _round(values: np.ndarray) -> list[float]:
    return values.round(4).tolist()


def _round_all(values: Mapping[str, float]) -> dict[str, float]:
    return {name: round(value, 4) for name, value in values.items()}

"""The sections of `results/claims.md` about the order of the networks, and what changes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from nep.bench.comparisons import correct_rows
from nep.bench.paper.paper_numbers import PAPER_TABLE_1
from nep.bench.paper.paper_tables import CLAIM, VERDICT, Claim
from nep.bench.paper.training import Training
from nep.players.checkpoints import load_checkpoint
from nep.report.boards import place_tag
from nep.report.results import ScoreSummary
from nep.report.statistics import LEVEL, correct_holm
from nep.report.tables import (
    Difference,
    TableColumn,
    compute_difference,
    format_difference,
    join_table,
    lay_out,
)
from tools.claims.plan import LOCATION, ORDER, RATES, SOURCES, SWITCHES
from tools.claims.scores import ClaimsScores, list_homes, round_all

_WITH_MESSAGES = ("gcn", "heat")
_OUTSIDE = 40  # of so many 95 % intervals, one lies above what is true by chance, and one below


@dataclass(frozen=True, slots=True)
class NetworkComparison:
    """A network with messages minus NEP-MLP, under the same conditions.

    Attributes:
        where: conditions, as in the tables.
        network: in `ORDER`.
        difference: of shares of right first guesses.
    """

    where: str
    network: str
    difference: Difference

    def __str__(self) -> str:
        """Say who, where and by how much."""
        difference = format_difference(self.difference, ".3f")
        return f"{ORDER[self.network]}, {self.where}: {difference}"


class NetworkSections:
    """Makes the sections one after the other; the last one counts what the others compared."""

    def __init__(self, scores: ClaimsScores) -> None:
        """Take what was played."""
        self._scores = scores
        self._compared: list[NetworkComparison] = []

    def make_orders(self) -> tuple[str, Any]:
        """HEAT before GCN before MLP: all trainings."""
        cells: list[list[str]] = []
        lines: list[tuple[str, int, Claim]] = []
        kept: dict[str, Any] = {}
        for source, where in SOURCES.items():
            for nodes in LOCATION:
                seeds = range(self._scores.plan.num_seeds)
                scores = {
                    name: self._scores.load_trainings(source, nodes, (name,), seeds)
                    for name in ORDER
                }
                title = f"{where}, {nodes}"
                cells.append([title, *(_list_means(by_seed) for by_seed in scores.values())])
                kept[f"{source}-{nodes}"] = {
                    name: {seed: list_homes(summary) for seed, summary in by_seed.items()}
                    for name, by_seed in scores.items()
                }
                lines += [(title, *found) for found in self._compare(title, scores)]
        paper = [
            [f"the paper, {nodes}"]
            + [f"{PAPER_TABLE_1[LOCATION[nodes].name][title][0]:.3f}" for title in ORDER.values()]
            for nodes in LOCATION
        ]
        text = [
            "## HEAT before GCN before MLP?\n",
            "Predict Object Location, share of right first guesses: mean over trainings, in "
            "brackets those of seed 0, 1, ... as far as they were run. *On* and *off* say "
            "whether objects come and go.\n",
            join_table(["homes", *ORDER.values()], [*cells, *paper]),
            "A training draws its homes, weights and batches by its seed. Detectable: the "
            "smallest true difference that would be found with 80 % power. Holds or reversed: p, "
            f"corrected by Holm's method for all {len(lines)} rows, is below .05.\n",
            _lay_out_claims("homes", lines),
        ]
        return "\n".join(text), kept

    def make_switches(self) -> tuple[str, Any]:
        """One change at a time."""
        seed = self._scores.plan.switch_seed
        plain = self._scores.load_changed({name: (name,) for name in ORDER})
        lines = [_make_switch_row("as it is", plain, {}, [])]
        kept = {"as it is": plain}
        for title, by_network in SWITCHES.values():
            changed = self._scores.load_changed(by_network)
            lines.append(_make_switch_row(title, changed, plain, self._compared))
            kept[title] = changed
        header = ["change", *ORDER.values(), "GCN minus MLP", "HEAT minus MLP"]
        text = [
            "## Why: one change at a time\n",
            f"32 places, on, one training each (seed {seed}), so that intervals are over homes "
            "alone. In brackets: minus the same network without the change. Where a change "
            "concerns one of two networks, the last columns compare with the other as it is. How "
            "much trainings differ is left out.\n",
            join_table(header, lines),
            "Configs: `mlp_equal.yaml` and `gcn_equal.yaml` (wider embeddings), `no_absence.yaml` "
            "(edges count sightings alone), `no_prior.yaml` (as in Table 2), `homes_400.yaml` "
            "(40,000 memories, 6 epochs: as many updates), `heat_two_heads.yaml`, "
            "`two_convolutions.yaml`.\n",
            self._count_parameters(),
        ]
        return "\n".join(text), {
            title: {
                name: list_homes(summary)
                for name, summary in by_network.items()
                if summary is not None
            }
            for title, by_network in kept.items()
        }

    def make_rates(self) -> tuple[str, Any]:
        """The paper's learning rate, and the best of three."""
        plan, lines = self._scores.plan, []
        tested: dict[str, dict[str, ScoreSummary]] = {name: {} for name in ORDER}
        known: dict[str, dict[str, float]] = {name: {} for name in ORDER}
        for rate, configs in RATES.items():
            scores_of_rate = self._scores.load_changed({name: (name, *configs) for name in ORDER})
            for name, score in scores_of_rate.items():
                training = plan.make_training("sampled", "on", (name, *configs), plan.switch_seed)
                if score is not None and training.is_done():
                    tested[name][rate] = score
                    known[name][rate] = read_validation(training)
        chosen = {
            name: max(by_rate, key=by_rate.__getitem__)
            for name, by_rate in known.items()
            if len(by_rate) == len(RATES)  # best of three, or of none
        }
        for rate in RATES:
            line = [rate]
            for name in ORDER:
                if rate not in known[name]:
                    line += ["", ""]
                    continue
                mark = "**" if chosen.get(name) == rate else ""
                line.append(f"{mark}{known[name][rate]:.3f}{mark}")
                line.append(f"{mark}{tested[name][rate].home_values.mean():.3f}{mark}")
            lines.append(line)
        claims: list[tuple[str, int, Claim]] = []
        for title, by_network in {
            **{rate: dict.fromkeys(ORDER, rate) for rate, configs in RATES.items() if configs},
            "best of three": chosen,
        }.items():
            scores = {
                name: {0: tested[name][rate]}
                if (rate := by_network.get(name, "")) in tested[name]
                else {}
                for name in ORDER
            }
            found = self._compare(f"learning rate {title}", scores)
            claims += [(title, *entry) for entry in found]
        header = [f"{title}, {part}" for title in ORDER.values() for part in ("validation", "test")]
        text = [
            "## Learning rates\n",
            f"32 places, on, one training each (seed {plan.switch_seed}); the paper has 1e-4. "
            "Validation: hits@1 in 2,000 memories of 20 homes that are neither those of training "
            "nor of the test, after the last epoch. The rate that is best there is bold; test "
            "scores chose nothing.\n",
            join_table(["learning rate", *header], lines),
            _lay_out_claims("learning rate", claims),
        ]
        return "\n".join(text), {
            "validation": {name: round_all(by_rate) for name, by_rate in known.items()},
            "test": {
                name: {rate: list_homes(summary) for rate, summary in by_rate.items()}
                for name, by_rate in tested.items()
            },
            "chosen": chosen,
        }

    def make_messages(self) -> tuple[str, Any]:
        """Whether messages pay anywhere in the sections before."""
        once = {
            comparison.difference: comparison for comparison in reversed(self._compared)
        }  # best may be of one rate
        rows = sorted(
            once.values(), key=lambda comparison: comparison.difference.mean, reverse=True
        )
        corrected = correct_holm([comparison.difference.p for comparison in rows])
        decided = [comparison for comparison in rows if comparison.difference.p < 1 - LEVEL]
        better = [comparison for comparison in decided if comparison.difference.mean > 0]
        worse = [comparison for comparison in decided if comparison.difference.mean < 0]
        num_left = sum(p < 1 - LEVEL for p in corrected)
        text = [
            "## Do messages pay?\n",
            f"Of {len(rows)} comparisons of GCN or HEAT with NEP-MLP in the tables above, "
            f"{len(better)} {'has' if len(better) == 1 else 'have'} p below .05 in favour of "
            f"messages, {len(worse)} against them. By chance alone, one of {_OUTSIDE} has, and one "
            f"of {_OUTSIDE} against. After Holm's correction {num_left} "
            f"{'is' if num_left == 1 else 'are'} left.\n",
        ]
        if better or worse:
            named = [f"- better: {comparison}" for comparison in better] + [
                f"- worse: {comparison}" for comparison in worse
            ]
            text.append("\n".join(named) + "\n")
        if rows:
            most = max(comparison.difference.high for comparison in rows)
            text.append(
                f"The highest is {rows[0]}; the lowest {rows[-1]}. No interval reaches above "
                f"{most:+.3f}.\n"
            )
        return "\n".join(text), [
            {
                "where": comparison.where,
                "network": comparison.network,
                **round_all(asdict(comparison.difference)),
            }
            for comparison in rows
        ]

    def _compare(
        self, where: str, scores: Mapping[str, Mapping[int, ScoreSummary]]
    ) -> list[tuple[int, Claim]]:
        """Compare every two networks over the seeds that both have, and say how many these are."""
        found = []
        for worse, better in combinations(ORDER, 2):
            seeds = sorted(scores[better].keys() & scores[worse].keys())
            if not seeds:
                continue
            first, second = (
                ScoreSummary.join([scores[name][seed] for seed in seeds])
                for name in (better, worse)
            )
            difference = compute_difference(first, second)
            if worse == "mlp":
                self._compared.append(NetworkComparison(where, better, difference))
            claim = Claim(LOCATION["on"], ORDER[better], ORDER[worse], difference)
            found.append((len(seeds), claim))
        return found

    def _count_parameters(self) -> str:
        """Say how many parameters the networks have, and those that were made equal."""
        plan, counts = self._scores.plan, []
        for configs in (*((name,) for name in ORDER), *SWITCHES["equal"][1].values()):
            training = plan.make_training("sampled", "on", configs, plan.switch_seed)
            if training.is_done():
                counts.append(f"`{configs[0]}` {count_parameters(training):,}")
        return f"Parameters: {', '.join(counts)}.\n" if counts else ""


def _lay_out_claims(title: str, rows: Sequence[tuple[str, int, Claim]]) -> str:
    """Make a table of claims, of where, trainings and claim."""
    corrected = correct_rows([claim for _, _, claim in rows])

    def read(column: TableColumn) -> TableColumn:
        return TableColumn(column.title, lambda row: column.make_cell(row[2]))

    columns = (
        TableColumn(title, lambda row: row[0]),
        read(CLAIM),
        TableColumn("trainings", lambda row: str(row[1])),
        *map(read, VERDICT),
    )
    shown = [(where, num, claim) for (where, num, _), claim in zip(rows, corrected, strict=True)]
    return lay_out(shown, columns, 2)


def _make_switch_row(
    title: str,
    changed: Mapping[str, ScoreSummary | None],
    plain: Mapping[str, ScoreSummary | None],
    compared: list[NetworkComparison],
) -> list[str]:
    """Make the cells of a change; comparisons with NEP-MLP are appended to `compared`."""
    cells = [title]
    for name in ORDER:
        summary, before = changed.get(name), plain.get(name)
        cell = "" if summary is None else f"{summary.home_values.mean():.3f}"
        if summary is not None and before is not None:
            cell += f" ({format_difference(compute_difference(summary, before), '.3f')})"
        cells.append(cell)
    both = {**plain, **changed}
    for name in _WITH_MESSAGES:
        summary, base = both.get(name), both.get("mlp")
        if summary is None or base is None or not {name, "mlp"} & changed.keys():
            cells.append("")
            continue
        compared.append(NetworkComparison(title, name, compute_difference(summary, base)))
        cells.append(format_difference(compared[-1].difference, ".3f"))
    return cells


def read_validation(training: Training) -> float:
    """Return hits@1 in the validation memories, as logged after the last epoch."""
    events = EventAccumulator(str(training.folder)).Reload()
    return float(events.Scalars(place_tag("val/hits_at_1"))[-1].value)


def count_parameters(training: Training) -> int:
    """Count the parameters of the trained network."""
    module = load_checkpoint(training.checkpoint).module
    return sum(parameter.numel() for parameter in module.parameters())


def _list_means(by_seed: Mapping[int, ScoreSummary]) -> str:
    means: Sequence[float] = [float(summary.home_values.mean()) for summary in by_seed.values()]
    if not means:
        return ""
    return f"{np.mean(means):.3f} ({', '.join(f'{mean:.3f}' for mean in means)})"

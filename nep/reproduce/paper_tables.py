"""Tables 1 and 2 of the paper from stored scores, as Markdown, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nep.config_files import CONFIG_FOLDER
from nep.report.figures import draw_scores, make_png
from nep.report.results import ScoreSummary
from nep.report.statistics import LEVEL
from nep.report.tables import (
    BOUNDED,
    TOP,
    Difference,
    Row,
    TableColumn,
    compute_difference,
    compute_rows,
    correct_rows,
    format_difference,
    format_number,
    format_p,
    join_table,
    lay_out,
    make_csv,
    make_markdown,
)
from nep.reproduce.experiments import (
    ABLATED,
    ABLATION_SETTING,
    ABLATIONS,
    CLAIMED_ORDER,
    MODELS,
    SETTINGS,
    Setting,
    find_models,
)
from nep.reproduce.paper_numbers import ABOUT_SPREAD, PAPER_TABLE_1, PAPER_TABLE_2
from sgm.files import VERSION, VersionError, check_version, read_json
from sgm.messages import shorten
from simulator.policies.registry import ORACLES, POLICIES
from simulator.tasks.metrics import METRICS
from simulator.tasks.registry import TASKS

# Scores by title of the contestant, in one setting.
Scores = Mapping[str, ScoreSummary]
_NEXT = "the row above"
_FORMAT = ".3f"  # as the paper writes all its numbers
# Contestants that are given the rules of the simulator; the network reads `home_filter`'s belief.
KNOWS_RULES = ("prior_filter", "home_filter", "informed", "NEP-HEAT+")
SHOWN = {
    "NEP-HEAT+": "NEP-HEAT+ (reads `home_filter`)",
    "oracle": "oracle (no bound)",
    "ceiling": "ceiling of first guesses",
}
_ABOUT_KNOWN = """\
`prior_filter` and `home_filter` are Bayes filters that are given the rules. NEP-HEAT+ reads the
belief of `home_filter`, and was trained on 400 homes with another loss: it does not compete on the
terms of the others. The ceiling knows the true dynamics, and orders places by its belief about
where a thing is now. That bounds first guesses and looks, not NDCG (in brackets), which asks where
a thing usually goes.
"""
# What to say of single rows.
_ABOUT_ROWS = {
    "NEP-HEAT+ (no belief)": "NEP-HEAT+ (no belief) is given no rules. It was trained as NEP-HEAT+ "
    "is, on 400 homes with another loss, where the other networks have 100 homes.\n",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What to write under a table; all but the configs stand in its JSON file.

    Attributes:
        command: makes it again.
        seed, num_homes, steps: of the test homes.
        num_trainings: of every network, the first one with this seed, too.
        title: of the page.
        played: version and commit that the homes were played with, each once.
        versions: of packages.
        test_sets: names of the test homes (`simulator.test_sets`), those that have one.
        checkpoints: SHA-256 of the networks that played, by setting, title and training.
        configs: name of the config of each network, by its title.
    """

    command: str
    seed: int
    num_homes: int
    steps: int
    num_trainings: int = 1
    title: str = "Table 1"
    played: Sequence[str] = ()
    versions: Mapping[str, str]
    test_sets: Sequence[str] = ()
    checkpoints: Mapping[str, str] = field(default_factory=dict)
    configs: Mapping[str, str]

    @property
    def size(self) -> str:
        """Say how much was played."""
        size = f"{self.num_homes} test homes x {self.steps} steps, seed {self.seed}"
        if self.num_trainings == 1:
            return size
        return f"{size}, networks with the mean of {self.num_trainings} trainings"

    def list_configs(self) -> list[str]:
        """Say what each network was trained with, a paragraph or none."""
        configs = []
        for title, name in self.configs.items():
            is_ours = (CONFIG_FOLDER / name).is_file()  # one of a user has a name alone
            link = f"[{name}](../nep/configs/{name})" if is_ours else f"`{name}`"
            configs.append(f"{title} {link}")
        return [f"Configs: {', '.join(configs)}.\n"] if configs else []

    @property
    def pairs(self) -> str:
        """Say over what differences are paired."""
        return "homes" if self.num_trainings == 1 else "homes and trainings"

    @property
    def about_trainings(self) -> str:
        """Say what intervals leave out, a sentence or none."""
        if self.num_trainings > 1 or not self.configs:
            return ""
        return "Each network was trained once, so that intervals leave out how trainings differ. "

    def make_footer(self) -> str:
        """Return command, seed and versions as Markdown."""
        versions = ", ".join(f"{name} {number}" for name, number in self.versions.items())
        seeds = f"Seed {self.seed} of training and homes"
        if self.num_trainings > 1:
            last = self.seed + self.num_trainings - 1
            seeds = f"Seeds {self.seed} to {last} of training, {self.seed} of the test homes"
        sets = f"; test homes {', '.join(self.test_sets)}" if self.test_sets else ""
        lines = [f"{seeds}{sets}; {versions}."]
        lines += [f"Played with {'; '.join(self.played)}."] if self.played else []
        if "commit" not in self.versions:
            lines.append("The commit was not kept when this was played.")
        if self.checkpoints:
            lines.append("Checkpoints, SHA-256:\n")
            lines += [f"- {name}: `{checksum}`" for name, checksum in self.checkpoints.items()]
        elif self.configs:
            lines.append("Checksums of the checkpoints were not kept.")
        text = "\n".join(lines)
        return f"```\n{self.command}\n```\n\n{text}\n"


@dataclass(frozen=True, slots=True)
class Claim:
    """That one contestant is better than another in a setting, and what the homes say.

    Attributes:
        setting: where.
        better, worse: titles.
        difference: score of `better` minus that of `worse`, paired over homes.
        corrected: p after Holm's correction for all claims of a table; nan before it.
    """

    setting: Setting
    better: str
    worse: str
    difference: Difference
    corrected: float = float("nan")

    @property
    def verdict(self) -> str:
        """Return "holds" or "reversed" if the corrected p decides it, else "undecided"."""
        if not self.corrected < 1 - LEVEL:
            return "undecided"
        is_better = (self.difference.mean > 0) == self.setting.metric.is_higher_better
        return "holds" if is_better else "reversed"


def compute_table(setting: Setting, scores: Scores) -> list[Row]:
    """Return the rows of one setting, worst first, each also compared with the row above it."""
    rows = compute_rows(TASKS[setting.task], scores)
    compared = []
    for position, row in enumerate(rows):
        above = None
        if position:
            above = compute_difference(scores[row.policy], scores[rows[position - 1].policy])
        compared.append(replace(row, differences={**row.differences, _NEXT: above}))
    return compared


def list_claims(setting: Setting, rows: Sequence[Row], scores: Scores) -> list[Claim]:
    """Compare the networks as the paper orders them, and each with the best heuristic.

    Where they were trained several times, all pairs of models are compared, not only neighbours.
    Networks that are no part of Table 1 are compared with each of those that the paper orders.
    """
    claimed = [title for title in CLAIMED_ORDER if title in scores]
    is_several = any(len(scores[title].by_training) > 1 for title in claimed)
    pairs = list(pairwise(claimed))
    if is_several:
        more = [model.title for model in MODELS if model.title in scores]
        pairs = list(combinations(dict.fromkeys([*claimed, *more]), 2))
    others = {*scores} - {*POLICIES, *(model.title for model in MODELS)}
    pairs += [(title, other) for other in sorted(others) for title in claimed]
    heuristics = [
        row.policy for row in rows if row.policy in POLICIES and row.policy not in ORACLES
    ]
    networks = [row.policy for row in reversed(rows) if row.policy not in POLICIES]
    pairs += [(network, heuristics[-1]) for network in networks]
    return [
        Claim(setting, better, worse, compute_difference(scores[better], scores[worse]))
        for better, worse in pairs
    ]


def make_table_1(
    results: Mapping[Setting, Scores], provenance: Provenance, page: str = "table_1"
) -> dict[str, bytes]:
    """Return the files of Table 1 by name: Markdown, CSV and the means of every home as JSON."""
    tables = {setting: compute_table(setting, scores) for setting, scores in results.items()}
    claims = correct_rows(
        [
            claim
            for setting, rows in tables.items()
            for claim in list_claims(setting, rows, results[setting])
        ]
    )
    parts = [
        f"# {provenance.title}\n",
        f"Mean ± standard deviation over {provenance.size}. ↑: more is better, ↓: less is better. "
        "*Knows*: what a method is given besides its own looks and the prior: the rules of the "
        "simulator, or the true dynamics of the home. Of those that are given neither, the best is "
        "bold. The CSV has the numbers unrounded, the JSON the mean of every home.\n",
        _make_combined(tables),
        "![Every method with its 95 % interval over homes; in grey those that are given the rules "
        f"or the home]({page}.png)\n",
        _ABOUT_KNOWN + _say_oracle(results),
        *(
            text
            for title, text in _ABOUT_ROWS.items()
            if any(title in by_title for by_title in results.values())
        ),
        *provenance.list_configs(),
        "## The paper's Table 1\n",
        f"{ABOUT_SPREAD}\n",
        _make_paper_table_1(results),
        "## Which orderings hold\n",
        f"Score of the first minus that of the second, paired over {provenance.pairs}, with 95 % "
        "intervals (of looks, less is better). Detectable: the smallest true difference that would "
        "be found with 80 % power. Decided where p of the paired t test, corrected by Holm's "
        f"method for all {len(claims)} rows, is below .05. {provenance.about_trainings}"
        "The heuristic is the best one of each setting in these homes.\n",
        lay_out(claims, (_SETTING, CLAIM, *VERDICT), 2),
        *(make_markdown(TASKS[s.task], rows, s.title) for s, rows in tables.items()),
        provenance.make_footer(),
    ]
    content = {"version": VERSION, **asdict(provenance)}
    del content["configs"]
    content["settings"] = {
        setting.name: {row.policy: _pack(row, results[setting][row.policy]) for row in rows}
        for setting, rows in tables.items()
    }
    named = {setting.name: rows for setting, rows in tables.items()}
    return {
        f"{page}.png": make_png(draw_table_1(results), Comment=provenance.command),
        f"{page}.md": "\n".join(parts).encode(),
        f"{page}.csv": make_csv(named, key="setting").encode(),
        f"{page}.json": (json.dumps(content) + "\n").encode(),
    }


def draw_table_1(results: Mapping[Setting, Scores]) -> Figure:
    """Draw a panel for each task: who is given nothing in colour, who is given more in grey."""
    panels: dict[str, dict[str, dict[str, np.ndarray]]] = {}
    names: dict[str, str] = {}
    for setting, scores in results.items():
        arrow = "more" if setting.metric.is_higher_better else "less"
        task = f"{TASKS[setting.task].title}: {setting.metric.title}, {arrow} is better"
        nodes_title = f"objects {'come and go' if setting.dynamic_nodes else 'stay in the home'}"
        names |= list_shown(scores)
        panels.setdefault(task, {})[nodes_title] = {
            shown: scores[title].home_values for title, shown in list_shown(scores).items()
        }
    colors = {
        shown: "#7f7f7f" if find_known(title) else "#1f77b4" if title in POLICIES else "#d62728"
        for title, shown in names.items()
    }
    return draw_scores(panels, colors)


def load_table_1(path: Path) -> tuple[dict[Setting, Scores], Provenance]:
    """Read `table_1.json`: scores of every home, and what was known when they were played.

    Raises:
        ValueError: if it is no such file.
    """
    try:
        content = read_json(path)
        check_version("table", content["version"], path)
        settings = {setting.name: setting for setting in SETTINGS}
        results: dict[Setting, Scores] = {
            settings[name]: {title: _unpack(row) for title, row in rows.items()}
            for name, rows in content["settings"].items()
        }
        titles = {title for scores in results.values() for title in scores}
        configs = {model.title: model.file for model in MODELS if model.title in titles}
        known = {
            field.name: content[field.name]
            for field in fields(Provenance)
            if field.name != "configs"
        }
        provenance = Provenance(**known, configs=configs)
    except VersionError:
        raise
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"stored must be a table_1.json of nep.reproduce, got {shorten(error)} in {path}. "
            "Make it with --table 1."
        ) from error
    return results, provenance


def make_table_2(scores: Scores, provenance: Provenance) -> dict[str, bytes]:
    """Return the files of Table 2 by name: Markdown and CSV.

    Args:
        scores: of the ablated networks, by name of `list_ablations`, and of the
            full ones, by name of the model.
        provenance: what to write under it.
    """
    header = ["", *(model.title for model in find_models(ABLATED))]
    ours, changes, paper, lines = [], [], [], []
    for ablation in (None, *ABLATIONS):
        title = ABLATIONS[ablation] if ablation else "Full model"
        summaries = [scores[f"{model}-{ablation}" if ablation else model] for model in ABLATED]
        ours.append([title, *(_format(*_summarise(score)) for score in summaries)])
        paper.append(
            [title, *(f"{PAPER_TABLE_2[ablation][model][0]:{_FORMAT}}" for model in ABLATED)]
        )
        deltas = [
            compute_difference(score, scores[model]) if ablation else None
            for model, score in zip(ABLATED, summaries, strict=True)
        ]
        if ablation:
            written = (
                f"{format_difference(delta, _FORMAT)}, d {format_number(delta.detectable, _FORMAT)}"
                for delta in deltas
                if delta is not None
            )
            changes.append([title, *written])
        for model, score, delta in zip(ABLATED, summaries, deltas, strict=True):
            line = [ablation or "full", model, *_summarise(score)]
            lines.append(line + ([delta.mean, delta.low, delta.high] if delta else [None] * 3))
    parts = [
        "# Table 2\n",
        f"{ABLATION_SETTING.title}: accuracy, mean ± standard deviation over {provenance.size}.\n",
        join_table(header, ours),
        "## Minus the full model\n",
        f"Paired over {provenance.pairs}, with 95 % intervals; d is the smallest true difference "
        f"that would be found with 80 % power. {provenance.about_trainings}\n",
        join_table(header, changes),
        f"{_say_most_critical(scores)}\n",
        "## The paper's Table 2\n",
        f"{ABOUT_SPREAD}\n",
        join_table(header, paper),
        provenance.make_footer(),
    ]
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    columns = ["minus_full", "minus_full_low", "minus_full_high"]
    writer.writerows([["ablation", "model", "mean", "std", *columns], *lines])
    return {"table_2.md": "\n".join(parts).encode(), "table_2.csv": file.getvalue().encode()}


def _say_oracle(results: Mapping[Setting, Scores]) -> str:
    """Say what the oracle bounds: nothing, and where networks are level with it."""
    known = "The oracle knows the true dynamics and its own looks, and bounds nothing"
    parts = []
    for setting, scores in results.items():
        networks = {
            title: float(summary.home_values.mean())
            for title, summary in scores.items()
            if title not in POLICIES and not find_known(title)
        }
        if "oracle" in scores and networks and setting.metric.name == "accuracy":
            best = max(networks, key=networks.__getitem__)
            oracle = float(scores["oracle"].home_values.mean())
            where = "come and go" if setting.dynamic_nodes else "stay"
            parts.append(
                f"{oracle:.3f} beside {networks[best]:.3f} of {best} where objects {where}"
            )
    return f"{known}: {', '.join(parts)}.\n" if parts else ""


def _say_most_critical(scores: Scores) -> str:
    """Say without which part the networks lose most, in the paper and here."""
    ours, papers = {}, {}
    for ablation, title in ABLATIONS.items():
        full = [float(scores[model].home_values.mean()) for model in ABLATED]
        without = [float(scores[f"{model}-{ablation}"].home_values.mean()) for model in ABLATED]
        part = title.removeprefix("(-) ").lower()
        ours[part] = float(np.mean(full) - np.mean(without))
        papers[part] = float(
            np.mean([PAPER_TABLE_2[None][model][0] for model in ABLATED])
            - np.mean([PAPER_TABLE_2[ablation][model][0] for model in ABLATED])
        )
    critical, most = max(papers, key=papers.__getitem__), max(ours, key=ours.__getitem__)
    text = (
        f"In the paper the {critical} is the most critical part: without it the three networks "
        f"lose {papers[critical]:.3f} on the mean, and {papers[most]:.3f} without {most}. "
    )
    if most == critical:
        return f"{text}So it is here: they lose {ours[most]:.3f}."
    return (
        f"{text}Here it is reversed: they lose {ours[critical]:.3f} without the {critical}, and "
        f"{ours[most]:.3f} without {most}."
    )


def _make_combined(tables: Mapping[Setting, Sequence[Row]]) -> str:
    """Rows are contestants, heuristics first and oracles last; columns are settings."""
    cells = {
        setting: {row.policy: _format(row.mean, row.std) for row in rows}
        for setting, rows in tables.items()
    }
    for setting, rows in tables.items():
        if fair := [row.policy for row in rows if not find_known(row.policy)]:
            cells[setting][fair[-1]] = f"**{cells[setting][fair[-1]]}**"
        if setting.metric.name not in BOUNDED and TOP in cells[setting]:
            cells[setting][TOP] = f"({cells[setting][TOP]})"
    return _make_wide(cells, says_known=True)


def _make_paper_table_1(played: Iterable[Setting]) -> str:
    """Return the columns that were played, all of them where none of the paper's was."""
    reported = [setting for setting in SETTINGS if setting.name in PAPER_TABLE_1]
    reported = [setting for setting in reported if setting in {*played}] or reported
    return _make_wide(
        {
            setting: {
                title: f"{mean:{_FORMAT}}"
                for title, (mean, _) in PAPER_TABLE_1[setting.name].items()
            }
            for setting in reported
        }
    )


def _make_wide(cells: Mapping[Setting, Mapping[str, str]], says_known: bool = False) -> str:
    """Rows are contestants, columns are settings; a cell is empty where one has not played."""
    header = ["method", "knows"] if says_known else ["method"]
    for setting in cells:
        arrow = "↑" if setting.metric.is_higher_better else "↓"
        header.append(f"{TASKS[setting.task].title} {arrow}, {setting.nodes}")
    lines = []
    for title, shown in list_shown(
        {title for column in cells.values() for title in column}
    ).items():
        name = [shown, find_known(title)] if says_known else [title]
        lines.append([*name, *(column.get(title, "") for column in cells.values())])
    return join_table(header, lines, num_text=2 if says_known else 1)


def list_shown(titles: Iterable[str]) -> dict[str, str]:
    """Return the titles of contestants as tables show them, by title.

    Heuristics come first, in the order of `POLICIES`, then networks, then oracles.
    """
    order = [name for name in POLICIES if name not in ORACLES]
    order += [model.title for model in MODELS]
    others = sorted({*titles} - {*order, *ORACLES})  # from configs that are no part of Table 1
    order = [*order, *others, *ORACLES]
    found = sorted(titles, key=lambda title: (bool(find_known(title)), order.index(title)))
    return {title: SHOWN.get(title, title) for title in found}


def find_known(title: str) -> str:
    """Return what a contestant is given: "rules", "home", or "" for neither."""
    if title in ORACLES:
        return "home"
    return "rules" if title in KNOWS_RULES else ""


# Columns of a table of claims.
_SETTING = TableColumn("setting", lambda claim: claim.setting.title)
CLAIM = TableColumn("claim", lambda claim: f"{claim.better} better than {claim.worse}")
VERDICT = (
    TableColumn("difference [95 %]", lambda claim: format_difference(claim.difference, _FORMAT)),
    TableColumn("detectable", lambda claim: format_number(claim.difference.detectable, _FORMAT)),
    TableColumn("Holm's p", lambda claim: format_p(claim.corrected)),
    TableColumn("verdict", lambda claim: claim.verdict),
)


def _pack(row: Row, scores: ScoreSummary) -> dict[str, Any]:
    numbers = {"mean": row.mean, "std": row.std, **row.metrics}
    return {
        **{name: None if math.isnan(x) else round(x, 6) for name, x in numbers.items()},
        "mean_of_each_home": scores.home_values.round(6).tolist(),
        **({} if scores.trainings is None else {"trainings": scores.trainings.round(6).tolist()}),
    }


def _unpack(row: Mapping[str, Any]) -> ScoreSummary:
    nan = float("nan")
    metrics = {name: nan if row[name] is None else float(row[name]) for name in METRICS}
    if "trainings" in row:
        trainings = np.array(row["trainings"], dtype=float)  # (S, H)
        return ScoreSummary(trainings.mean(axis=0)[:, None], metrics, trainings)
    return ScoreSummary(np.array(row["mean_of_each_home"], dtype=float)[:, None], metrics)


def _summarise(scores: ScoreSummary) -> tuple[float, float]:
    return float(scores.home_values.mean()), float(scores.home_values.std())


def _format(mean: float, std: float) -> str:
    return f"{mean:{_FORMAT}} ± {std:{_FORMAT}}"

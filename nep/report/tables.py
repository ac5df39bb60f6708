"""Tables of results: one per task, policies from worst to best."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from nep.report.results import ScoreSummary
from nep.report.statistics import (
    average_units,
    compute_detectable,
    compute_gap_closed,
    compute_interval,
    compute_p_value,
    correct_holm,
)
from sgm.messages import shorten
from simulator.policies.registry import ORACLES, find_policy
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from simulator.tasks.task import Task

# Whom every policy is compared with unless others are named.
REFERENCES = ("bayesian", "last_seen_prior")
FLOOR, TOP = "bayesian", "ceiling"
# What `TOP` bounds: it orders places by where a thing is now. NDCG asks where it usually goes.
BOUNDED = ("accuracy", "looks")
_GAP = "gap closed"
# Homes from which on intervals are shown: of two, an interval is 13 standard errors wide each way.
FEWEST_HOMES = 3


@dataclass(frozen=True, slots=True)
class Difference:
    """A policy's score minus that of another one, paired over homes; nan of a single home.

    Attributes:
        mean: over homes.
        low, high: 95 % interval (`nep.report.statistics`).
        p: that of the t test, not corrected.
        detectable: the smallest true difference that would be found with 80 % power.
    """

    mean: float
    low: float
    high: float
    p: float
    detectable: float

    @classmethod
    def of(cls, values: np.ndarray, units: Sequence[str] | None = None) -> Difference:
        """Summarise differences.

        Args:
            values: home by home, (H,), or by training and home, (S, H).
            units: which home or household each of them is of, (H,); None if all differ.
        """
        values = average_units(values, units)
        return cls(
            float(values.mean()),
            *compute_interval(values),
            compute_p_value(values),
            compute_detectable(values),
        )


@dataclass(frozen=True, slots=True)
class Row:
    """How a policy did in a task.

    Attributes:
        policy: its name.
        mean, std: score, and its standard deviation over homes (docs/design.md, ruling 22), nan of
            a single one.
        differences: to each reference that played, None to itself.
        gap_closed: share of the way from Bayesian to the ceiling, None unless both played and the
            ceiling bounds the score.
        metrics: what was computed of its answers, by name in `METRICS`.
        num_homes: homes or households that it played in.
    """

    policy: str
    mean: float
    std: float
    differences: Mapping[str, Difference | None]
    gap_closed: float | None
    metrics: Mapping[str, float]
    num_homes: int


def compute_difference(summary: ScoreSummary, other: ScoreSummary) -> Difference:
    """Compare two policies home by home, and training by training where there are several.

    Raises:
        ValueError: if both were trained several times, but not equally often, or they played in
            other homes.
    """
    if summary.units != other.units:
        raise ValueError(
            f"policies must play in the same homes to be paired, got {shorten(summary.units)} and "
            f"{shorten(other.units)}. Evaluate both in the same."
        )
    counts = {len(summary.by_training), len(other.by_training)} - {1}
    if len(counts) > 1:
        raise ValueError(
            f"policies must be trained equally often to be paired, got {max(counts)} and "
            f"{min(counts)} trainings. Train as many of both."
        )
    delta = summary.by_training - other.by_training  # (S, H)
    return Difference.of(delta if counts else delta[0], summary.units)


def correct_rows(rows: Sequence[Any]) -> list[Any]:
    """Return comparisons with the p of each `difference` corrected together, by Holm's method.

    A row that is the `same_as` another one counts for nothing, and has none.
    """
    known = [float("nan") if getattr(row, "same_as", None) else row.difference.p for row in rows]
    corrected = correct_holm(known)
    return [replace(row, corrected=p) for row, p in zip(rows, corrected, strict=True)]


def compute_rows(
    task: type[Task], scores: Mapping[str, ScoreSummary], references: Sequence[str] = REFERENCES
) -> list[Row]:
    """Summarise what every policy scored in the same homes, worst first."""
    rows = []
    for name, summary in scores.items():
        values = summary.home_values  # (H,)
        differences = {
            reference: None if reference == name else compute_difference(summary, scores[reference])
            for reference in references
            if reference in scores
        }
        gap = None
        if task.metric in BOUNDED and FLOOR in scores and TOP in scores:
            floor, top = (float(scores[other].home_values.mean()) for other in (FLOOR, TOP))
            gap = compute_gap_closed(float(values.mean()), floor, top) + 0.0  # no minus zero
        rows.append(
            Row(
                policy=name,
                mean=float(values.mean()),
                std=float(values.std()) if len(values) > 1 else float("nan"),
                differences=differences,
                gap_closed=gap,
                metrics=summary.metrics,
                num_homes=len(set(summary.units)) if summary.units else len(values),
            )
        )
    is_higher_better = STEP_METRICS[task.metric].is_higher_better
    return sorted(rows, key=lambda row: row.mean if is_higher_better else -row.mean)


def format_table(
    task: type[Task], rows: list[Row], more: Mapping[str, Metric] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Return the header and the cells of a table; `more` are metrics besides `METRICS`.

    What a few homes do not tell is left out; `tell_few_homes` says so.
    """
    num_homes = min((row.num_homes for row in rows), default=0)
    has_std, has_intervals = num_homes > 1, num_homes >= FEWEST_HOMES
    references = list(rows[0].differences) if rows else []
    has_gap = any(row.gap_closed is not None for row in rows)
    metric = STEP_METRICS[task.metric]
    header = ["policy", metric.title, *["std"] * has_std]
    header += [f"minus {name}{' [95 %]' * has_intervals}" for name in references]
    header += [_GAP] * has_gap
    columns = [*METRICS.values(), *(more or {}).values()]
    header += [column.title for column in columns]
    cells = []
    for row in rows:
        numbers = (row.mean, row.std) if has_std else (row.mean,)
        line = [row.policy, *(format_number(x, metric.format) for x in numbers)]
        for name in references:
            delta = row.differences.get(name)
            if delta is None or has_intervals:
                line.append(format_difference(delta, metric.format))
            else:
                line.append(format_number(delta.mean, f"+{metric.format}"))
        if has_gap:
            line.append("" if row.gap_closed is None else format_number(row.gap_closed, ".0%"))
        line += [format_number(row.metrics[column.name], column.format) for column in columns]
        cells.append(line)
    return header, cells


def tell_few_homes(rows: Sequence[Row]) -> str:
    """Say that there are too few homes for intervals; empty where there are enough."""
    num_homes = min((row.num_homes for row in rows), default=FEWEST_HOMES)
    if num_homes >= FEWEST_HOMES:
        return ""
    lacks = "intervals" if num_homes > 1 else "spread and intervals"
    homes = "One home is" if num_homes == 1 else f"{num_homes} homes are"
    return f"{homes} too few for {lacks}. Play in {FEWEST_HOMES} or more."


def describe_policies(names: Sequence[str]) -> str:
    """Say what the policies of a table are given, those of one kind together."""
    given: dict[str, list[str]] = {}
    for name in names:
        policy = find_policy(name)
        if name in ORACLES or policy.needs:
            what = "are given what no robot knows, how the things of this very home move"
        elif policy.__module__.startswith("simulator.policies.filters"):
            what = "are given the rules by which homes are simulated"
        else:
            what = "are rules that read the memory and the prior alone"
        given.setdefault(what, []).append(name)
    return " ".join(f"{', '.join(alike)} {what}." for what, alike in given.items())


def format_number(value: float, form: str) -> str:
    """Return a number as a cell; "n/a" where there is none."""
    return "n/a" if math.isnan(value) else format(value, form)


def format_p(p: float) -> str:
    """Return a p as a cell."""
    return "< .001" if p < 0.001 else format_number(p, ".3f")


def format_difference(delta: Difference | None, form: str) -> str:
    """Return a difference with its interval, signed; empty where there is none."""
    if delta is None:
        return ""
    mean, low, high = (format_number(x, f"+{form}") for x in (delta.mean, delta.low, delta.high))
    return f"{mean} [n/a]" if math.isnan(delta.low) else f"{mean} [{low}, {high}]"


def make_rich_table(
    task: type[Task], rows: list[Row], title: str, more: Mapping[str, Metric] | None = None
) -> Table:
    """Make the table for a terminal: scores, comparisons and metrics of one's own.

    Calibration and the like are left to the files, and what share of a gap is closed.
    """
    header, cells = format_table(task, rows, more)
    last = len(header) - len(more or {})
    shown = [*range(last - len(METRICS)), *range(last, len(header))]
    shown = [position for position in shown if header[position] != _GAP]
    few = tell_few_homes(rows) or None
    table = Table(title=escape(title), caption=few, box=SIMPLE_HEAD, pad_edge=False, padding=0)
    for position in shown:
        name = header[position]
        # Only intervals may take two lines where the terminal is narrow.
        table.add_column(name, justify="right" if position else "left", no_wrap="[" not in name)
    for line in cells:
        table.add_row(*(escape(line[position]) for position in shown))
    return table


def make_markdown(
    task: type[Task], rows: list[Row], title: str, more: Mapping[str, Metric] | None = None
) -> str:
    """Make the table as Markdown, under a heading, with what its comparisons could detect."""
    text = f"## {title}\n\n{join_table(*format_table(task, rows, more))}"
    few = tell_few_homes(rows)
    if few:
        return f"{text}\n{few}\n"
    form, parts = STEP_METRICS[task.metric].format, []
    for name in rows[0].differences if rows else ():
        known = [row.differences[name] for row in rows]
        found = [
            difference.detectable
            for difference in known
            if difference and not math.isnan(difference.detectable)
        ]
        if found:
            parts.append(f"minus {name} {min(found):{form}} to {max(found):{form}}")
    if parts:
        text += f"\nWould be found with 80 % power, if true: {', '.join(parts)}. Not corrected.\n"
    return text


class TableColumn(NamedTuple):
    """A column of a table: its title, and what makes the cell of a row."""

    title: str
    make_cell: Callable[[Any], str]


def lay_out(rows: Iterable[Any], columns: Sequence[TableColumn], num_text: int = 1) -> str:
    """Make a Markdown table of rows and columns; the first `num_text` columns are text."""
    cells = [[column.make_cell(row) for column in columns] for row in rows]
    return join_table([column.title for column in columns], cells, num_text)


def join_table(header: Sequence[str], cells: Iterable[Sequence[str]], num_text: int = 1) -> str:
    """Join cells to a Markdown table; the first `num_text` columns are text, the others numbers."""
    rules = ["---"] * num_text + ["---:"] * (len(header) - num_text)
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, rules, *cells))


def make_csv(
    tables: Mapping[str, Sequence[Row]],
    key: str = "task",
    more: Mapping[str, Metric] | None = None,
    references: Sequence[str] = REFERENCES,
) -> str:
    """Make one CSV of all tables, numbers unrounded; `key` names the first column."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    differences = [f"minus_{name}{part}" for name in references for part in ("", "_low", "_high")]
    names = [*METRICS, *(more or {})]
    writer.writerow([key, "policy", "mean", "std", *differences, "gap_closed", *names])
    for task, rows in tables.items():
        for row in rows:
            numbers: list[float | None] = [row.mean, row.std]
            for name in references:
                delta = row.differences.get(name)
                numbers += [delta.mean, delta.low, delta.high] if delta else [None] * 3
            numbers += [row.gap_closed, *(row.metrics[name] for name in names)]
            cells = [None if x is None or math.isnan(x) else x for x in numbers]
            writer.writerow([task, row.policy, *cells])
    return file.getvalue()

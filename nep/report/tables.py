"""Tables of results: one per task, policies from worst to best."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from nep.report.statistics import compute_bootstrap_interval, compute_gap_closed
from simulator.tasks.task import Task

# Whom every policy is compared with unless others are named.
REFERENCES = ("bayesian", "last_seen_prior")
FLOOR, TOP = "bayesian", "ceiling"


class ScoreSummary(Protocol):
    """What a table needs to know of a policy's scores; `TaskScores` and stored ones have it."""

    @property
    def home_values(self) -> np.ndarray:
        """Mean score per home, (H,)."""

    @property
    def accuracy(self) -> np.ndarray:
        """Share of right answers per home, (H,)."""

    @property
    def away_accuracy(self) -> float:
        """Share of right answers about objects that were not where they had last been seen."""

    @property
    def calibration_error(self) -> float:
        """Expected calibration error."""

    @property
    def nll(self) -> float:
        """Mean negative log likelihood of the true places."""

    @property
    def candidate_recall(self) -> float:
        """Share of queries whose true place had a score."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A policy's score minus that of another one, paired over homes.

    Attributes:
        mean: over homes.
        low, high: 95 % bootstrap interval.
    """

    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Row:
    """How a policy did in a task.

    Attributes:
        policy: its name.
        mean, std: score, and its standard deviation over homes (docs/design.md, ruling 22).
        differences: to each reference that played, None to itself.
        gap_closed: share of the way from Bayesian to the ceiling, None unless both played.
        accuracy, away_accuracy: share of right answers, of all and of those about objects that
            were not where the agent had last seen them.
        calibration_error, nll: of the scores as probabilities.
        candidate_recall: share of queries whose true place had a score.
    """

    policy: str
    mean: float
    std: float
    differences: Mapping[str, Difference | None]
    gap_closed: float | None
    accuracy: float
    away_accuracy: float
    calibration_error: float
    nll: float
    candidate_recall: float


def compute_difference(own: ScoreSummary, other: ScoreSummary) -> Difference:
    """Compare two policies home by home."""
    delta = own.home_values - other.home_values  # (H,)
    return Difference(float(delta.mean()), *compute_bootstrap_interval(delta))


def compute_rows(
    task: type[Task], scores: Mapping[str, ScoreSummary], references: Sequence[str] = REFERENCES
) -> list[Row]:
    """Summarise what every policy scored in the same homes, worst first.

    Args:
        task: what was played.
        scores: by policy.
        references: whom every policy is compared with, home by home, where they played.
    """
    rows = []
    for name, own in scores.items():
        values = own.home_values  # (H,)
        differences: dict[str, Difference | None] = {}
        for reference in references:
            if reference in scores:
                differences[reference] = (
                    None if reference == name else compute_difference(own, scores[reference])
                )
        gap = None
        if FLOOR in scores and TOP in scores:
            floor, top = (float(scores[other].home_values.mean()) for other in (FLOOR, TOP))
            gap = compute_gap_closed(float(values.mean()), floor, top) + 0.0  # no minus zero
        rows.append(
            Row(
                policy=name,
                mean=float(values.mean()),
                std=float(values.std()),
                differences=differences,
                gap_closed=gap,
                accuracy=float(own.accuracy.mean()),
                away_accuracy=own.away_accuracy,
                calibration_error=own.calibration_error,
                nll=own.nll,
                candidate_recall=own.candidate_recall,
            )
        )
    return sorted(rows, key=lambda row: row.mean if task.is_higher_better else -row.mean)


def format_table(task: type[Task], rows: list[Row]) -> tuple[list[str], list[list[str]]]:
    """Return the header and the cells of a table."""
    references = list(rows[0].differences) if rows else []
    has_gap = any(row.gap_closed is not None for row in rows)
    digits = 3 if task.is_higher_better else 2
    header = ["policy", task.metric, "std"]
    header += [f"minus {name} [95 %]" for name in references]
    header += ["gap closed"] * has_gap
    header += ["answers right", "right if away", "ECE", "NLL", "recall"]
    cells = []
    for row in rows:
        line = [row.policy, f"{row.mean:.{digits}f}", f"{row.std:.{digits}f}"]
        for name in references:
            delta = row.differences.get(name)
            line.append(
                f"{delta.mean:+.{digits}f} [{delta.low:+.{digits}f}, {delta.high:+.{digits}f}]"
                if delta
                else ""
            )
        if has_gap:
            line.append("" if row.gap_closed is None else f"{row.gap_closed:.0%}")
        line += [f"{row.accuracy:.3f}", f"{row.away_accuracy:.3f}"]
        line += [f"{row.calibration_error:.3f}", f"{row.nll:.2f}", f"{row.candidate_recall:.3f}"]
        cells.append(line)
    return header, cells


def make_rich_table(task: type[Task], rows: list[Row], title: str) -> Table:
    """Make the table for a terminal: scores and comparisons; calibration is left to the files."""
    header, cells = format_table(task, rows)
    shown = header.index("answers right")
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False, padding=0)
    for position, name in enumerate(header[:shown]):
        # Only intervals may take two lines where the terminal is narrow.
        table.add_column(name, justify="right" if position else "left", no_wrap="[" not in name)
    for line in cells:
        table.add_row(*(escape(cell) for cell in line[:shown]))
    return table


def make_markdown(task: type[Task], rows: list[Row], title: str) -> str:
    """Make the table as Markdown, under a heading."""
    return f"## {title}\n\n{join_table(*format_table(task, rows))}"


def join_table(header: Sequence[str], cells: Iterable[Sequence[str]], num_text: int = 1) -> str:
    """Join cells to a Markdown table; the first `num_text` columns are text, the others numbers."""
    rules = ["---"] * num_text + ["---:"] * (len(header) - num_text)
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, rules, *cells))


def make_csv(tables: Mapping[str, Sequence[Row]], key: str = "task") -> str:
    """Make one CSV of all tables, numbers unrounded; empty where there is none.

    Args:
        tables: rows by task, or by what else `key` says.
        key: name of the first column.
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    columns = ["accuracy", "away_accuracy", "calibration_error", "nll", "candidate_recall"]
    differences = [f"minus_{name}{part}" for name in REFERENCES for part in ("", "_low", "_high")]
    writer.writerow([key, "policy", "mean", "std", *differences, "gap_closed", *columns])
    for task, rows in tables.items():
        for row in rows:
            line: list[str | float | None] = [task, row.policy, row.mean, row.std]
            for name in REFERENCES:
                delta = row.differences.get(name)
                line += [delta.mean, delta.low, delta.high] if delta else [None] * 3
            writer.writerow([*line, row.gap_closed, *(getattr(row, name) for name in columns)])
    return file.getvalue()

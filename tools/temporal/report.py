"""The table of temporal networks, from what has been played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nep.bench.paper.temporal_scores import MEMORY, TableRow, make_temporal_error, read_temporal
from nep.report.statistics import correct_holm
from nep.report.tables import (
    Difference,
    compute_difference,
    format_difference,
    format_number,
    format_p,
    join_table,
)
from tools.temporal.plan import COLUMNS
from tools.temporal.registry import NETWORKS

SIGHTINGS, NEGATIVES = "sightings", "sightings and negative looks"
SCORES = "temporal.json"
_KNOWS_MORE = ("ceiling", "oracle")
_ABOUT = """\
Temporal graph networks, rules of temporal graph learning, and graph memories on where things are in
homes. All places of a home are candidates, and ties are averaged.

- **Training.** Every temporal network learns from what `bayesian` saw in the same {train_homes}
  homes x {train_steps} steps. Epochs: {epochs}, {batch_homes} homes at a time. The loss is
  listwise over all places.
- **Settings** are chosen in {val_homes} validation homes. Trials of each network: {trials} (Optuna,
  seeded, with pruning). Epochs of a trial: {trial_epochs}.
- **Test.** Every player is asked {steps} questions in each of {num_homes} test homes, and makes
  {searches} searches there, with its own looks.
- **Input.** Networks read text vectors of labels, random features that tell the nodes of a home
  apart, and the prior of each place. They read sightings alone, or negative looks, too.
- **Graph memories** are the weights named in the command. Their model cards say what they were
  trained on.

*Trainings*: how many a row is the mean of. *Minus*: first guesses minus those of the best rule,
paired over homes and trainings, with 95 % intervals. That rule is the best of the table in these
test homes, which favours it. *p* is corrected by Holm's method for each table. *Detectable* would
be found with 80 % power. Cost is processor time on one core. `ceiling` knows the true dynamics.
"""


def read_scores(path: Path) -> dict[str, Any]:
    """Read stored scores, of which a report can be made.

    Raises:
        ValueError: if it is no such file.
    """
    content = read_temporal(path, "stored")
    try:
        make_report(content)
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise make_temporal_error("stored", error, path) from error
    return content


def make_report(content: Mapping[str, Any]) -> str:
    """Write the report from what `python -m nep.bench temporal` keeps as JSON.

    Args:
        content: `sizes`, `command`, `made`, `missing`, `note` if there is one, and, by kind,
            `title`, `units` and `rows`.
    """
    parts = [
        "# Temporal graph networks\n",
        _ABOUT.format(**content["sizes"]),
        f"`{content['command']}` makes it again, and goes on where it was stopped; "
        f"{content['made']}.\n",
    ]
    if content.get("note"):
        parts.append(f"{content['note']}\n")
    if content["missing"]:
        names = _name_missing(content["missing"])
        parts.append(
            f"**Not complete**: {len(content['missing'])} trainings of the plan have not been "
            f"made, and rows have as many as they say. Missing: {names}.\n"
        )
    for table in content["kinds"].values():
        parts.append(f"## {table['title']}\n")
        rows = [TableRow(**row) for row in table["rows"]]
        units = None if table["units"] is None else tuple(table["units"])
        parts.append(_make_table(rows, units))
        parts.append(_compare_memories(rows, units))
        parts.append(_compare_information(rows, units))
    return "\n".join(part for part in parts if part)


def _name_missing(missing: Sequence[str]) -> str:
    """Name each network once, with the numbers of its trainings that are missing."""
    seeds: dict[str, list[str]] = {}
    for name in missing:
        network, _, seed = name.rpartition(" seed ")
        seeds.setdefault(network, []).append(seed)
    return "; ".join(
        f"{network} seed{'s' * (len(numbers) > 1)} {', '.join(numbers)}"
        for network, numbers in seeds.items()
    )


def _make_table(rows: Sequence[TableRow], units: tuple[str, ...] | None) -> str:
    order = sorted(rows, key=lambda row: row.mean("first_guess"))
    rules = [
        row
        for row in order
        if not row.num_trainings and row.name not in _KNOWS_MORE and row.reads != MEMORY
    ]
    best = rules[-1] if rules else None
    differences: list[Difference | None] = [
        None
        if best is None or row is best or row.name in _KNOWS_MORE
        else compute_difference(row.summarise(units), best.summarise(units))
        for row in order
    ]
    corrected = correct_holm([float("nan") if d is None else d.p for d in differences])
    header = [
        "player",
        "reads",
        "trainings",
        "first guess",
        "MRR",
        "NLL",
        "looks",
        "ms a decision",
        "s to train",
        f"minus {best.name if best else 'best rule'} [95 %]",
        "p",
        "detectable",
    ]
    lines = []
    for row, difference, p in zip(order, differences, corrected, strict=True):
        numbers = [format_number(row.mean(name), metric.format) for name, metric in COLUMNS.items()]
        lines.append(
            [
                row.name,
                row.reads,
                str(row.num_trainings or ""),
                *numbers,
                format_number(row.mean("milliseconds"), ".2f"),
                "" if np.isnan(row.seconds) else f"{row.seconds:.0f}",
                *_write_difference(difference, p),
            ]
        )
    return join_table(header, lines, num_text=2)


def _write_difference(difference: Difference | None, p: float) -> list[str]:
    if difference is None:
        return ["", "", ""]
    detectable = format_number(difference.detectable, ".3f")
    return [format_difference(difference, ".3f"), format_p(p), detectable]


def _compare_memories(rows: Sequence[TableRow], units: tuple[str, ...] | None) -> str:
    """Say how far every graph memory is ahead of every temporal network in first guesses."""
    memories = [row for row in rows if row.reads == MEMORY]
    networks = sorted(
        (row for row in rows if row.num_trainings), key=lambda row: row.mean("first_guess")
    )
    if not memories or not networks:
        return ""
    differences = [
        [compute_difference(memory.summarise(units), row.summarise(units)) for memory in memories]
        for row in networks
    ]
    corrected = iter(correct_holm([difference.p for row in differences for difference in row]))
    header = ["network", "reads", "trainings"]
    for memory in memories:
        header += [f"{memory.name} is ahead by [95 %]", "p", "detectable"]
    lines = []
    for row, found in zip(networks, differences, strict=True):
        line = [row.name, row.reads, str(row.num_trainings)]
        for ahead in found:
            line += _write_difference(ahead, next(corrected))
        lines.append(line)
    return "Graph memories beside networks, first guesses:\n\n" + join_table(
        header, lines, num_text=2
    )


def _compare_information(rows: Sequence[TableRow], units: tuple[str, ...] | None) -> str:
    """Say what negative looks add to each network, where both versions have been trained."""
    lines, pairs = [], []
    for cls in NETWORKS.values():
        by_reads = {row.reads: row for row in rows if row.name == cls.name}
        if by_reads.keys() >= {SIGHTINGS, NEGATIVES}:
            both = by_reads[NEGATIVES], by_reads[SIGHTINGS]
            count = min(row.num_trainings for row in both)
            cut = [TableRow(row.name, row.reads, row.plays[:count], count) for row in both]
            pairs.append((cls.name, count, compute_difference(*(r.summarise(units) for r in cut))))
    corrected = correct_holm([difference.p for *_, difference in pairs])
    for (name, count, difference), p in zip(pairs, corrected, strict=True):
        lines.append([name, str(count), *_write_difference(difference, p)])
    if not lines:
        return ""
    header = ["network", "trainings of each", "negative looks add [95 %]", "p", "detectable"]
    return "What negative looks add to first guesses:\n\n" + join_table(header, lines)

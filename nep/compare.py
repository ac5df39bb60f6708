"""Compares the results of two runs in the same homes: `python -m nep.compare A.json B.json`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from nep.report.results import Results
from nep.report.tables import (
    compute_difference,
    format_difference,
    format_number,
    join_table,
)
from sgm.messages import shorten
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.policies.registry import ORACLES
from simulator.process import run_main
from simulator.tasks.metrics import STEP_METRICS

# Settings of `nep.evaluate` that say who plays, not where: two runs may differ in them.
_PLAYERS = ("checkpoints", "policies", "tasks")
_FIRST_HOME = "first_home"  # the checksum of a home
_MOST_SHOWN = 3  # settings that a message names
_CHECKSUM_LENGTH = 64


def compare(first: Results, second: Results) -> str:
    """Return a Markdown table for every task that both have played.

    A policy that both have is compared with itself; every other one of the second run with the
    best of the first that is no oracle. All differences are second minus first, paired over homes,
    with 95 % intervals. Detectable is the smallest true difference that would be found with 80 %
    power.

    Raises:
        ValueError: if the runs were played in other homes, by other rules, or share no task.
    """
    _check_homes(first, second)
    tasks = [task for task in first.tasks if task in second.tasks]
    if not tasks:
        raise ValueError(
            f"results must share a task, got {', '.join(first.tasks)} and "
            f"{', '.join(second.tasks)}. Evaluate the same --tasks."
        )
    return "\n".join(_compare_task(task, first, second) for task in tasks)


def _check_homes(first: Results, second: Results) -> None:
    names = {*first.config, *second.config} - {*_PLAYERS}
    # A checksum comes last: it says that homes differ, and a setting says how.
    for name in sorted(names, key=lambda name: (name == _FIRST_HOME, name)):
        differing = list(find_differences(first.config.get(name), second.config.get(name), name))
        if not differing:
            continue
        parts = [
            f"{setting} {_show(ours)} and {_show(theirs)}" for setting, ours, theirs in differing
        ]
        more = f", and {len(parts) - _MOST_SHOWN} more" if len(parts) > _MOST_SHOWN else ""
        advice = "Evaluate with the same options"
        if name == _FIRST_HOME:
            advice = "All settings are equal, and the code made other homes: use the same commit"
        raise ValueError(
            f"results must be of the same homes and rules, got {'; '.join(parts[:_MOST_SHOWN])}"
            f"{more}. {advice}{_name_versions(first, second)}."
        )


def find_differences(ours: Any, theirs: Any, name: str) -> Iterator[tuple[str, object, object]]:
    """Yield name and both values of each setting that differs, down to the innermost."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for key in sorted({*ours, *theirs}):
            yield from find_differences(ours.get(key), theirs.get(key), f"{name}.{key}")
    elif ours != theirs:
        yield name, ours, theirs


def _show(value: object) -> str:
    """Return a setting for a message; of a checksum its beginning."""
    if isinstance(value, str) and len(value) == _CHECKSUM_LENGTH and value.isalnum():
        return f"{value[:8]}... (a checksum)"
    return shorten(value)


def _name_versions(first: Results, second: Results) -> str:
    """Return which versions differ, for a message."""
    differing = [
        f"{package} {first.versions.get(package)} and {second.versions.get(package)}"
        for package in sorted({*first.versions, *second.versions})
        if first.versions.get(package) != second.versions.get(package)
    ]
    return f" and versions, which are {', '.join(differing)}" if differing else ""


def _compare_task(task: str, first: Results, second: Results) -> str:
    about = first.get_title(task)
    metric = STEP_METRICS[about.metric]
    ours, theirs = first.tasks[task], second.tasks[task]
    counts = sorted({len(summary.values) for summary in (*ours.values(), *theirs.values())})
    if not ours or not theirs or len(counts) > 1:
        raise ValueError(
            f"both results must have played {task} in as many homes, got {counts}. Was a file "
            "edited? Make it again."
        )
    mean = {name: float(summary.home_values.mean()) for name, summary in ours.items()}
    players = [name for name in mean if name not in ORACLES] or list(mean)
    best = (max if metric.is_higher_better else min)(players, key=lambda name: mean[name])
    lines = []
    for name, summary in theirs.items():
        other = name if name in ours else best
        difference = compute_difference(summary, ours[other])
        lines.append(
            [
                name,
                other,
                format(float(summary.home_values.mean()), metric.format),
                format(mean[other], metric.format),
                format_difference(difference, metric.format),
                format_number(difference.detectable, metric.format),
            ]
        )
    header = ["second", "first", metric.title, "first's", "difference [95 %]", "detectable"]
    num_homes, num_steps = next(iter(theirs.values())).values.shape
    better = "more" if metric.is_higher_better else "less"
    title = f"{about.title}, {num_homes} homes x {num_steps} steps, {better} is better"
    return f"## {title}\n\n{join_table(header, lines, num_text=2)}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m nep.compare",
        "Print how two runs of nep.evaluate in the same homes differ, home by home.",
    )
    parser.add_argument("first", type=Path, help="results.json of a run")
    parser.add_argument("second", type=Path, help="results.json of another one")
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        print(compare(Results.load(options.first), Results.load(options.second)), end="")


if __name__ == "__main__":
    run_main(main)

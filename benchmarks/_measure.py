"""Runs one benchmark: options, repetition, one JSON line."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Benchmark:
    """What is measured and what it is held against.

    Attributes:
        name: what is measured.
        unit: of the figure.
        goal: the figure to reach.
        limit: the figure that the work counted in the docstring of the file allows; None where
            nothing but the goal is known.
        is_higher_better: rates are, costs are not.
    """

    name: str
    unit: str
    goal: float
    limit: float | None = None
    is_higher_better: bool = True


# Measures once: the figure, and further figures by name.
Measure = Callable[[], tuple[float, dict[str, float]]]


def rate(work: Callable[[], int]) -> Measure:
    """Measure how many units per second `work` does; it returns how many it did."""

    def measure() -> tuple[float, dict[str, float]]:
        start = time.perf_counter()
        count = work()
        return count / (time.perf_counter() - start), {}

    return measure


def run(
    benchmark: Benchmark,
    prepare: Callable[[bool], tuple[Measure, str]],
    *,
    repeats: int = 5,
    uses_torch: bool = False,
    threads: int | None = None,
) -> None:
    """Measure and print one JSON line; the figure is the best of some repeats.

    The best, because whatever else runs on a machine can only make a repeat worse; the median and
    the worst are printed beside it.

    Args:
        benchmark: what is measured.
        prepare: gets whether to be tiny; returns the measurement and the size in words.
        repeats: how often it is measured; once if tiny.
        uses_torch: whether torch works, with `--threads`; without torch, one thread does.
        threads: of torch, where the benchmark itself says how many; then `--threads` is ignored.
    """
    parser = argparse.ArgumentParser(description=f"Measure: {benchmark.name}, {benchmark.unit}.")
    parser.add_argument("--tiny", action="store_true", help="run once, small: for the tests")
    parser.add_argument("--threads", type=int, help="of torch; all cores if left out")
    options = parser.parse_args()
    threads = _set_threads(threads or options.threads) if uses_torch else 1
    measure, size = prepare(options.tiny)
    found = [measure() for _ in range(1 if options.tiny else repeats)]
    found.sort(key=lambda pair: pair[0], reverse=benchmark.is_higher_better)
    figures = [figure for figure, _ in found]
    line: dict[str, Any] = {
        "benchmark": benchmark.name,
        "figure": _round(figures[0]),
        "unit": benchmark.unit,
        "goal": benchmark.goal,
        "limit": benchmark.limit,
        "is_met": (figures[0] >= benchmark.goal) == benchmark.is_higher_better
        or figures[0] == benchmark.goal,
        "lowest": _round(min(figures)),
        "median": _round(statistics.median(figures)),
        "highest": _round(max(figures)),
        "size": size,
        "threads": threads,
        **{name: _round(figure) for name, figure in found[0][1].items()},
    }
    print(json.dumps(line))


def _set_threads(threads: int | None) -> int:
    import torch  # here, so that what needs no torch does not wait for it

    if threads is not None:
        torch.set_num_threads(threads)
    return torch.get_num_threads()


def _round(figure: float) -> float:
    return float(f"{figure:.4g}")

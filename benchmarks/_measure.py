"""Runs one benchmark: options, repetition, one JSON line."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import torch


def run(name: str, unit: str, prepare: Callable[[bool], tuple[Callable[[], int], str]]) -> None:
    """Measure a rate and print it as one JSON line.

    Args:
        name: what is measured.
        unit: of the rate, such as "house-steps/s".
        prepare: gets whether to be tiny; returns the work, which gives the number of units done,
            and the size in words.
    """
    parser = argparse.ArgumentParser(description=f"Measure: {name}, in {unit}.")
    parser.add_argument("--tiny", action="store_true", help="run once, small: for the tests")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="of torch")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    work, size = prepare(options.tiny)
    rates = []
    for _ in range(1 if options.tiny else 5):
        start = time.perf_counter()
        count = work()
        rates.append(count / (time.perf_counter() - start))
    line = {
        "benchmark": name,
        "figure": round(statistics.median(rates), 1),
        "lowest": round(min(rates), 1),
        "highest": round(max(rates), 1),
        "unit": unit,
        "size": size,
        "threads": options.threads,
    }
    print(json.dumps(line))

"""How long the shipped prior takes to be read from its JSON file, and checked."""

from __future__ import annotations

import time
from pathlib import Path

from _measure import Benchmark, Measure, run

from sgm.prior import prior_graph
from sgm.prior.prior_graph import PriorGraph

PATH = Path(prior_graph.__file__).with_name("default.json")


def measure() -> tuple[float, dict[str, float]]:
    """Load it once."""
    start = time.perf_counter()
    PriorGraph.load(PATH)
    return time.perf_counter() - start, {}


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Nothing to prepare."""
    return measure, f"{PATH.stat().st_size / 1000:.0f} kB"


if __name__ == "__main__":
    run(Benchmark("load the prior", "s", 0.2, is_higher_better=False), prepare)

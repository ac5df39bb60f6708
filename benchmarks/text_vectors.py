"""How long it takes to turn 150 labels that were not met before into vectors.

The pipeline of spaCy is loaded before: it takes part of the start of a training, `first_batch.py`.
"""

from __future__ import annotations

import time

from _measure import Benchmark, Measure, run

from simulator.text import TextVectors
from simulator.text.train import __main__ as train


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the labels."""
    words = [word for group in train.load_taxonomy()["groups"] for word in group["words"]]
    labels = words[: 10 if tiny else 150]

    def measure() -> tuple[float, dict[str, float]]:
        text = TextVectors()  # nothing kept of the last time
        start = time.perf_counter()
        text.vectors(labels)
        return time.perf_counter() - start, {}

    return measure, f"{len(labels)} labels"


if __name__ == "__main__":
    run(Benchmark("text vectors", "s", 0.3, is_higher_better=False), prepare)

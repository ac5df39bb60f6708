"""How long it takes to turn 150 labels that the package does not know into vectors.

Beside it: loading the shipped pipeline, the same labels by spaCy, and labels whose vectors ship.
Each layer multiplies some 5 rows by 0.1 million weights, so 150 labels need 0.9 billion operations.
"""

from __future__ import annotations

import time

from _measure import Benchmark, Measure, run

from sgm.text import TextVectors
from sgm.text.vectors import SHIPPED_PIPELINE, SpacyEncoder, load_language
from tools.text_training import __main__ as train


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the labels."""
    words = [word for group in train.load_taxonomy()["groups"] for word in group["words"]]
    known = words[: 10 if tiny else 150]
    labels = [f"{word} {other}" for word, other in zip(known, reversed(known), strict=True)]

    def measure() -> tuple[float, dict[str, float]]:
        start = time.perf_counter()
        text = TextVectors()  # nothing kept of the last time
        loaded = time.perf_counter()
        text.vectors(labels)
        done = time.perf_counter()
        text.vectors(known)
        looked_up = time.perf_counter()
        by_spacy = SpacyEncoder(load_language(SHIPPED_PIPELINE))
        spacy_loaded = time.perf_counter()
        list(by_spacy.encode(labels))
        spacy_done = time.perf_counter()
        return done - loaded, {
            "load_s": loaded - start,
            "known_s": looked_up - done,
            "spacy_load_s": spacy_loaded - looked_up,
            "spacy_s": spacy_done - spacy_loaded,
        }

    return measure, f"{len(labels)} labels"


if __name__ == "__main__":
    run(Benchmark("text vectors", "s", 0.3, is_higher_better=False), prepare)

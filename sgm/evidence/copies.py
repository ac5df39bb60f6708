"""How many things of one description there may be: what is unique is at one place."""

from __future__ import annotations

import numpy as np

from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.prior.copies import get_copies

_USUAL = 0.05  # share of the things of a home that are known at two places, before any was seen


def compute_copies(asked: Question) -> dict[str, np.ndarray]:
    """What homes have of such things, what this one has, and where this one is known to be now."""
    memory, queries = asked.memory, asked.queries
    labels = [memory.labels[label] for label in memory.objects["label"][queries.object]]
    usual = np.array([get_copies(label) for label in labels], dtype=float).reshape(-1, 2)
    num_double, num_seen = count_doubles(memory)
    share = (num_double + 10 * _USUAL) / (num_seen + 10)
    return {
        "most_things": np.log(usual[:, 0]),
        "most_alike": np.log(usual[:, 0] / usual[:, 1]),
        "num_places_now": np.log1p(asked.counts.is_true.sum(axis=1)),
        "double_share": share[queries.home],
    }


def count_doubles(memory: MemoryBatch) -> tuple[np.ndarray, np.ndarray]:
    """Count the things of each home that are known at several places, and all seen, (H,) each.

    A place counts as long as the last look at it has shown the thing.
    """
    objects, edges = memory.objects, memory.edges
    true_at = edges["object"][edges["is_true"]] * memory.num_furniture
    place = np.unique(true_at + edges["furniture"][edges["is_true"]])
    num_places = np.bincount(place // memory.num_furniture, minlength=objects.num_rows)
    count = memory.num_homes
    doubles = np.bincount(objects["home"][num_places > 1], minlength=count)
    return doubles, np.bincount(objects["home"][objects["num_observed"] > 0], minlength=count)

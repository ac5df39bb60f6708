"""What is remembered of a question as flat arrays: a row of features per place."""

from __future__ import annotations

import numpy as np

from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.schema import NEVER

# Of a place and the object asked for: its prior weight; whether the last look there showed the
# object; how often it was seen there, and how often a look there missed it, log(1 + n); how lately
# it was seen there, and how lately the place was looked at, 1 / (1 + steps), 0 for never.
PLACE_COLUMNS = ("prior", "is_true", "num_true", "num_missed", "seen_lately", "looked_lately")


def compute_place_rows(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return the features of every furniture node for every query, float32 (Q, F, 6).

    They are named in `PLACE_COLUMNS`; all are 0 for what is no furniture of the query's home.
    """
    is_place = memory.is_furniture[queries.home]  # (Q, F)
    prior = queries.prior.sum(axis=2)
    query, edge = memory.edges_of(queries)
    place = (query, memory.edges["furniture"][edge])
    counts = {}
    for name in ("is_true", "num_true", "num_observed"):
        counts[name] = np.zeros(is_place.shape)
        np.add.at(counts[name], place, memory.edges[name][edge])
    last_true = np.full(is_place.shape, NEVER)
    np.maximum.at(last_true, place, memory.edges["last_true"][edge])
    last_look = memory.furniture_last_observed[queries.home]
    rows = np.stack(
        [
            prior,
            counts["is_true"] > 0,
            np.log1p(counts["num_true"]),
            np.log1p(counts["num_observed"] - counts["num_true"]),
            _compute_lateness(memory.time, last_true),
            _compute_lateness(memory.time, last_look),
        ],
        axis=2,
    )
    return (rows * is_place[:, :, None]).astype(np.float32)


def _compute_lateness(now: int, time: np.ndarray) -> np.ndarray:
    return np.where(time == NEVER, 0.0, 1 / (1.0 + now - time))

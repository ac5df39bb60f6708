"""Sightings that may be wrong: where a thing is if the last one was."""

from __future__ import annotations

import numpy as np

from sgm.belief import Belief
from sgm.evidence.adaptive_filter import compute_destinations
from sgm.evidence.expected_places import Expected
from sgm.evidence.object_counts import ObjectCounts
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries


def doubt_sightings(
    belief: Belief,
    memory: MemoryBatch,
    queries: Queries,
    is_looked: np.ndarray,
    elsewhere: float,
) -> Belief:
    """Weigh a belief by how sure the last sighting of each thing was.

    Policies and networks take a sighting that counts for true. With confidence c it was right with
    that probability, and else the thing is where its other sightings and the prior say:

        P = c P(policy) + (1 - c) P(without it)

    Where the last sighting is sure, or was no look (`is_looked`, bool (Q,)), the belief stays as it
    is, to the bit. Things that were never seen are `elsewhere` with that probability.
    """
    confidence = compute_confidence(memory, queries)
    doubted = np.flatnonzero((confidence < 1) & is_looked)
    if not len(doubted):
        return belief
    own = queries.take(doubted)
    counts = ObjectCounts.gather(memory, own)
    last = memory.objects["last_furniture"][own.object]
    num_true = counts.num_true.astype(float)
    num_true[np.arange(len(own.home)), last] -= 1
    others = counts._replace(num_true=num_true)
    goes = compute_destinations(memory, own, others, Expected.by_prior(memory, own))[:, :-1]
    gone = belief.elsewhere[doubted]
    gone = np.where(num_true.any(axis=1), gone, np.maximum(elsewhere, gone))
    without = Belief.of(goes).with_elsewhere(gone)
    mixed = Belief(belief.log_weights[doubted]).mix(without, 1 - confidence[doubted])
    log_weights = belief.log_weights.copy()
    log_weights[doubted] = mixed.log_weights
    return Belief(log_weights)


def compute_confidence(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return the confidence of the last sighting of each thing, 1 of what was never seen, (Q,)."""
    edges, objects = memory.edges, memory.objects
    query, edge = memory.edges_of(queries)
    thing = queries.object[query]
    is_last = edges["furniture"][edge] == objects["last_furniture"][thing]
    is_last &= edges["last_true"][edge] == objects["last_observed"][thing]
    found = np.zeros(len(queries.object))
    np.maximum.at(found, query[is_last], edges["confidence"][edge[is_last]])
    return np.where(found > 0, found, 1.0)

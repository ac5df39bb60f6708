"""Sightings that may be wrong: where a thing is if the last one was."""

from __future__ import annotations

import numpy as np

from sgm.belief import Belief
from sgm.evidence.adaptive_filter import compute_destinations
from sgm.evidence.expected_places import Expected
from sgm.evidence.object_counts import ObjectCounts
from sgm.kernel import kernel
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
    return _find_confidence(
        queries.object.astype(np.int64), objects["last_furniture"], objects["last_observed"],
        edges["object"], edges["furniture"], edges["last_true"], edges["confidence"],
    )  # fmt: skip


@kernel
def _find_confidence(
    query_object: np.ndarray,
    last_place: np.ndarray,
    last_time: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_last_true: np.ndarray,
    edge_confidence: np.ndarray,
) -> np.ndarray:
    """Find it for rows of objects, which may be asked for twice, int64 (Q,).

    What begins with `last` are columns of objects, (O,), with `edge` those of edges, (E,).
    """
    is_asked = np.zeros(len(last_place), dtype=np.bool_)
    found = np.zeros(len(last_place))
    for thing in query_object:
        is_asked[thing] = True
    for edge in range(len(edge_object)):
        thing = edge_object[edge]
        if is_asked[thing] and edge_place[edge] == last_place[thing]:
            if edge_last_true[edge] == last_time[thing]:
                found[thing] = max(found[thing], edge_confidence[edge])
    confidence = np.ones(len(query_object))
    for query in range(len(query_object)):
        if found[query_object[query]] > 0:
            confidence[query] = found[query_object[query]]
    return confidence

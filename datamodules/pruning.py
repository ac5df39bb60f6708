"""What a graph keeps around the questions: what a model with so many convolutions can read."""

from __future__ import annotations

import numpy as np

from simulator.snapshots.nodes_and_edges import Pairs


def prune(
    pairs: Pairs, is_query: np.ndarray, num_hops: int | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the query edges, and the edges that enter the in-neighbourhood of their ends.

    Args:
        pairs: of the whole graph.
        is_query: which of the pairs with an object are query edges, bool (M,).
        num_hops: convolutions: the neighbourhood is of `num_hops - 1` hops. With none, the query
            edges alone are kept, without those back to the object. None for all edges.

    Returns:
        Whether each node is kept, bool (N,); and the pairs that lead down and up, ascending.
    """
    keep = np.full(pairs.first_node[-1], num_hops is None)
    if num_hops is None:
        every = np.arange(len(pairs.child))
        return keep, every, every
    query = pairs.num_layout + np.flatnonzero(is_query)
    keep[pairs.child[query]] = keep[pairs.parent[query]] = True
    down, up = query[:0], query
    for _ in range(num_hops):
        up, down = np.flatnonzero(keep[pairs.parent]), np.flatnonzero(keep[pairs.child])
        keep[pairs.child[up]] = keep[pairs.parent[down]] = True
    return keep, down, up

"""Hypothetical edges: where a query object may be although it was never seen there."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group, mark_rows


def propose_places(
    prior_rows: np.ndarray, threshold: float = 0.0, is_furniture: np.ndarray | None = None
) -> np.ndarray:
    """Mark the places that get a hypothetical edge.

    Every place whose prior weight exceeds the threshold; where the prior knows no place at all
    for an object, every furniture node (as "onTop"), so that no query is without candidates.

    Args:
        prior_rows: prior weight per place, (..., F, 2); so is what is returned, bool.
        threshold: non-negative; 0 keeps everything the prior deems possible.
        is_furniture: which columns are furniture of the home asked, bool (..., F); None for all.

    Source: paper section 4.2, f_h; docs/design.md, ruling 12.
    """
    proposed = prior_rows > threshold  # nowhere beyond the furniture, where the prior is zero
    is_unknown = ~proposed.any(axis=(-2, -1))
    if is_unknown.any():
        proposed[is_unknown, :, 1] = True if is_furniture is None else is_furniture[is_unknown]
    return proposed


def propose_rows(
    prior_rows: np.ndarray, query: np.ndarray, num_queries: int, threshold: float = 0.0
) -> np.ndarray:
    """Mark places as `propose_places` does, where queries have different numbers of furniture.

    The furniture of all queries stands in one row: prior weights (n, 2) in, bool (n, 2) out;
    `query` is the query that each furniture node is for, (n,).
    """
    proposed = prior_rows > threshold
    is_known = mark_rows(query[proposed[:, 0] | proposed[:, 1]], num_queries)
    proposed[:, 1] |= ~is_known[query]
    return proposed


def sample_places(counts: np.ndarray, count: int, *, rng: np.random.Generator) -> np.ndarray:
    """Mark `count` furniture nodes of each query at random, as "onTop": an ablation.

    Of queries with `counts` furniture nodes each (Q,), all of these in one row, bool (sum, 2).

    Source: docs/design.md, ruling 13.
    """
    query = np.repeat(np.arange(len(counts)), counts)
    order = np.lexsort((rng.random(len(query)), query))
    chosen = np.zeros((len(query), 2), dtype=bool)
    chosen[order[compute_rank_in_group(query) < count], 1] = True
    return chosen

"""Questions to the memories of many homes, where their objects may be, and what looks change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group, mark_rows, max_relations
from sgm.schema import NUM_RELATIONS, RELATIONS, USUAL_RELATION

_USUAL = RELATIONS.index(USUAL_RELATION)


@dataclass(frozen=True, slots=True)
class Queries:
    """Objects that are asked for, one per entry; a home may have several.

    Attributes:
        home: home index, (Q,).
        object: row of the query object in `MemoryBatch.objects`, (Q,).
        prior: prior weight of each place for it, float32 (Q, F, relations).
        more_asked: how many more questions than the memory has counted were put when each was, of
            those that leave it as it is (`MemoryBatch.ask`), (Q,); None for 0.
        miss_rate: of the detector, where who asks was given one; None for what the memory counts.
        left_out: places to answer without, as if the home did not have them, bool (Q, F); None for
            none.
    """

    home: np.ndarray
    object: np.ndarray
    prior: np.ndarray
    more_asked: np.ndarray | None = None
    miss_rate: float | None = None
    left_out: np.ndarray | None = None

    def join(self, others: Queries) -> Queries:
        """Return these queries, and others after them, with the miss rate of these."""
        both, more, left_out = (self, others), None, None
        if any(queries.more_asked is not None for queries in both):
            none = [np.zeros(len(queries.home), dtype=np.int64) for queries in both]
            counts = zip((queries.more_asked for queries in both), none, strict=True)
            more = np.concatenate([zeros if given is None else given for given, zeros in counts])
        if any(queries.left_out is not None for queries in both):
            nothing = [np.zeros(queries.prior.shape[:2], dtype=bool) for queries in both]
            masks = zip((queries.left_out for queries in both), nothing, strict=True)
            left_out = np.concatenate([zeros if given is None else given for given, zeros in masks])
        return Queries(
            np.append(self.home, others.home),
            np.append(self.object, others.object),
            np.concatenate([self.prior, others.prior]),
            more,
            self.miss_rate,
            left_out,
        )

    def take(self, rows: np.ndarray) -> Queries:
        """Return some of the queries, by their numbers, (n,), or as a mask, bool (Q,)."""
        more = None if self.more_asked is None else self.more_asked[rows]
        return replace(
            self,
            home=self.home[rows],
            object=self.object[rows],
            prior=self.prior[rows],
            more_asked=more,
            left_out=None if self.left_out is None else self.left_out[rows],
        )


@dataclass(frozen=True, slots=True)
class Change:
    """Rows that one look has changed or made.

    Attributes:
        home: homes that looked, (n,).
        furniture: furniture index looked at, (n,).
        objects: rows of `MemoryBatch.objects`.
        edges: rows of `MemoryBatch.edges`.
        is_seen: whether the look found each of these edges true, bool, as long as `edges`.
        coverage: share of the furniture that was in view, (n,).
    """

    home: np.ndarray
    furniture: np.ndarray
    objects: np.ndarray
    edges: np.ndarray
    is_seen: np.ndarray
    coverage: np.ndarray


def propose_places(
    prior_rows: np.ndarray, threshold: float = 0.0, is_furniture: np.ndarray | None = None
) -> np.ndarray:
    """Mark the places that get a hypothetical edge.

    Every place whose prior weight exceeds the threshold; where the prior knows no place at all
    for an object, every furniture node, in the usual relation: no query is without candidates.

    Args:
        prior_rows: prior weight per place, (..., F, relations); so is what is returned, bool.
        threshold: non-negative; 0 keeps everything the prior deems possible.
        is_furniture: which columns are furniture of the home asked, bool (..., F); None for all.

    Source: paper section 4.2, f_h; docs/design.md, ruling 12.
    """
    proposed = prior_rows > threshold  # nowhere beyond the furniture, where the prior is zero
    is_unknown = ~proposed.any(axis=(-2, -1))
    if is_unknown.any():
        is_place = True if is_furniture is None else is_furniture[is_unknown]
        proposed[is_unknown, :, _USUAL] = is_place
    return proposed


def propose_rows(
    prior_rows: np.ndarray, query: np.ndarray, num_queries: int, threshold: float = 0.0
) -> np.ndarray:
    """Mark places as `propose_places` does, where queries have different numbers of furniture.

    The furniture of all queries stands in one row: prior weights (n, relations) in, bool alike out;
    `query` is the query that each furniture node is for, (n,).
    """
    proposed = prior_rows > threshold
    is_known = mark_rows(query[max_relations(proposed)], num_queries)
    proposed[:, _USUAL] |= ~is_known[query]
    return proposed


def sample_places(counts: np.ndarray, count: int, *, rng: np.random.Generator) -> np.ndarray:
    """Mark `count` furniture nodes of each query at random, in the usual relation: an ablation.

    Of queries with `counts` furniture nodes each (Q,), all in one row, bool (sum, relations).

    Source: docs/design.md, ruling 13.
    """
    query = np.repeat(np.arange(len(counts)), counts)
    order = np.lexsort((rng.random(len(query)), query))
    chosen = np.zeros((len(query), NUM_RELATIONS), dtype=bool)
    chosen[order[compute_rank_in_group(query) < count], _USUAL] = True
    return chosen

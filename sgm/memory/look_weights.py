"""How much of a look counts, for what it showed and for what it did not."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import mark_rows, share_relations, sum_relations
from sgm.arrays.table import Table
from sgm.schema import NUM_RELATIONS

# Of each relation in a set of them, a whole number.
RELATION_BITS = 1 << np.arange(NUM_RELATIONS)
SURE = 0.5  # from this confidence on, a sighting counts as true


class LookWeights:
    """Weighs one look in each home, edge by edge, of object and relation.

    Attributes:
        coverage: share of the furniture looked at that was in view, 0 without a look, (H,). Of
            shares by relation, the mean by how much the prior expects each.
        relations: of which relations r most was in view, where that is said: the sum of their 2^r,
            (H,); None where one share is for all.
        is_counted: whether it counts as a look at the furniture, bool (H,).
        confidence: of what was seen, the highest by object and relation, 0 for what was not, (O,
            2); None where all is sure.
    """

    def __init__(
        self,
        objects: Table,
        place_weights: np.ndarray,
        home: np.ndarray,
        furniture: np.ndarray,
        coverage: np.ndarray | None,
        hidden: np.ndarray | None = None,
    ) -> None:
        """Weigh looks of homes (n,) at furniture (n,).

        `objects` are all objects, `place_weights` those of the prior, (H, types, F, relations).
        The coverage is a share for each (n,), or by relation (n, relations), or None for all of it.
        Against `hidden` rows of objects (k,) the looks say nothing.
        """
        self._objects, num_homes = objects, len(place_weights)
        self._by_relation: np.ndarray | None = None  # (H, relations)
        self.relations: np.ndarray | None = None
        if coverage is not None and coverage.ndim == 2:
            self._by_relation = np.zeros((num_homes, NUM_RELATIONS))
            self._by_relation[home] = coverage
            self.relations = (self._by_relation >= SURE) @ RELATION_BITS
            coverage = _average(place_weights, home, furniture, coverage)
        self.coverage = np.zeros(num_homes)  # (H,)
        self.coverage[home] = 1.0 if coverage is None else coverage
        self.is_counted = self.coverage >= 0.5
        self._is_hidden: np.ndarray | None = None
        if hidden is not None and len(hidden):
            self._is_hidden = mark_rows(hidden, objects.num_rows)
        self._is_whole = coverage is None or bool((coverage == 1).all())
        self._is_whole &= self._by_relation is None and self._is_hidden is None
        self.confidence: np.ndarray | None = None

    def sort_out(
        self, seen_object: np.ndarray, seen_relation: np.ndarray, confidence: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Take note of confidences, and return objects and relations of the sure sightings."""
        self.confidence = np.zeros((self._objects.num_rows, NUM_RELATIONS))
        np.maximum.at(self.confidence, (seen_object, seen_relation), confidence)
        is_sure = confidence >= SURE
        return seen_object[is_sure], seen_relation[is_sure]

    def weigh(self, objects: np.ndarray, relation: np.ndarray) -> np.ndarray:
        """Return what part of a look counts against edges (n,), should they not be seen."""
        if self._is_whole and self.confidence is None:
            return np.ones(len(objects))
        weight = self._get_share(objects, relation)
        if self.confidence is None:
            return weight
        found = self.confidence[objects, relation]
        return np.where(found > 0, 1 - found, weight)

    def counts(self, objects: np.ndarray, relation: np.ndarray) -> np.ndarray:
        """Tell whether the look counts as one for what these edges are about, bool (n,)."""
        is_counted: np.ndarray = self.is_counted[self._objects["home"][objects]]
        if self._by_relation is None and self._is_hidden is None:
            return is_counted
        return self._get_share(objects, relation) >= SURE

    def find_out_of_view(self, objects: np.ndarray, relation: np.ndarray) -> np.ndarray | None:
        """Mark objects of edges (n,) whose remembered places here were out of view, bool (O,).

        None where one share is for all relations, and nothing is hidden.
        """
        if self._by_relation is None and self._is_hidden is None:
            return None
        num_objects = self._objects.num_rows
        is_counted = self.counts(objects, relation)
        is_out = mark_rows(objects[~is_counted], num_objects)
        is_out &= ~mark_rows(objects[is_counted], num_objects)
        return is_out

    def _get_share(self, objects: np.ndarray, relation: np.ndarray) -> np.ndarray:
        """Return how much was in view of the places of edges, (n,)."""
        home = self._objects["home"][objects]
        share: np.ndarray = self.coverage[home]
        if self._by_relation is not None:
            share = self._by_relation[home, relation]
        return share if self._is_hidden is None else share * ~self._is_hidden[objects]


def _average(
    place_weights: np.ndarray, home: np.ndarray, furniture: np.ndarray, coverage: np.ndarray
) -> np.ndarray:
    """Return coverages (n, relations) as one number, by how much the prior expects of each."""
    expected = place_weights[home, :, furniture].sum(axis=1)  # (n, relations)
    mean = sum_relations(share_relations(expected) * coverage)
    return np.where((coverage == coverage[:, :1]).all(axis=1), coverage[:, 0], mean)

"""How much of a look counts, for what it showed and for what it did not."""

from __future__ import annotations

import numpy as np

from sgm.memory.remembered import Remembered

SURE = 0.5  # from this confidence on, a sighting counts as true


class LookWeights:
    """Weighs one look in each home, edge by edge; the key of an edge is object * 2 + relation.

    Attributes:
        coverage: share of the furniture looked at that was in view, 0 without a look, (H,).
        is_counted: whether it counts as a look at the furniture, bool (H,).
    """

    def __init__(self, memory: Remembered, home: np.ndarray, coverage: np.ndarray | None) -> None:
        """Weigh the looks of homes (n,), each with its coverage (n,); None for all of it."""
        self._memory = memory
        self.coverage = np.zeros(memory.num_homes)  # (H,)
        self.coverage[home] = 1.0 if coverage is None else coverage
        self.is_counted = self.coverage >= 0.5
        self._is_whole = coverage is None or bool((coverage == 1).all())
        self._confidence: np.ndarray | None = None  # the highest by key, 0 for what was not seen

    def sort_out(
        self, seen_object: np.ndarray, seen_relation: np.ndarray, confidence: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Take note of confidences, and return objects and relations of the sure sightings."""
        self._confidence = np.zeros(2 * len(self._memory.objects))
        np.maximum.at(self._confidence, seen_object * 2 + seen_relation, confidence)
        is_sure = confidence >= SURE
        return seen_object[is_sure], seen_relation[is_sure]

    def get_confidence(self, keys: np.ndarray) -> np.ndarray | float:
        """Return the confidence of sightings, (n,) or one for all."""
        return 1.0 if self._confidence is None else self._confidence[keys]

    def weigh(self, keys: np.ndarray) -> np.ndarray:
        """Return what part of a look counts against keys (n,), should they not be seen."""
        if self._is_whole and self._confidence is None:
            return np.ones(len(keys))
        weight = self.coverage[self._memory.objects["home"][keys // 2]]
        if self._confidence is None:
            return weight
        found = self._confidence[keys]
        return np.where(found > 0, 1 - found, weight)

"""Descriptions such as "large red mug": a type with adjectives, as integer codes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sgm.prior.prior_graph import FurnitureType, ObjectType

Adjectives = Sequence[Sequence[str]]


class DescriptionTable:
    """Every description that the given types can have, numbered type by type.

    A description is drawn as the paper does: the number of adjective categories uniformly from
    1 to the number that the type has, then that many categories, then one adjective of each.
    One uniform number picks the whole description, so a draw never depends on the type.

    Attributes:
        num_descriptions: how many there are over all types.
        type_of_code: type index per description code, (num_descriptions,).

    Source: paper appendix A, "Environment Sampling".
    """

    def __init__(self, labels: Sequence[str], adjectives: Sequence[Adjectives]) -> None:
        self._labels = tuple(labels)
        self._combinations: list[tuple[str, ...]] = []
        type_of_code: list[int] = []
        probs: list[np.ndarray] = []
        for index, categories in enumerate(adjectives):
            words, prob = _list_combinations(categories)
            self._combinations.extend(words)
            type_of_code.extend([index] * len(words))
            cumulative = np.cumsum(prob)
            probs.append(index + cumulative / cumulative[-1])
        self.type_of_code = np.array(type_of_code, dtype=np.int32)
        self.num_descriptions = len(self._combinations)
        # One ascending ruler over all types: type t owns (t, t + 1].
        self._ruler = np.concatenate(probs) if probs else np.zeros(0)
        self._first_code = np.searchsorted(self.type_of_code, np.arange(len(labels) + 1))

    def sample(self, types: np.ndarray, uniform: np.ndarray) -> np.ndarray:
        """Draw a description code for each type index; (n,), (n,) in [0, 1) -> (n,) int32."""
        codes = np.searchsorted(self._ruler, types + uniform, side="right")
        # Where rounding leads beyond a type, its last code.
        codes = np.clip(codes, self._first_code[types], self._first_code[types + 1] - 1)
        return codes.astype(np.int32)

    def text(self, code: int) -> str:
        """Spell out one description, for example "large red mug"."""
        return " ".join((*self._combinations[code], self._labels[self.type_of_code[code]]))

    def compute_sameness(self) -> np.ndarray:
        """Return the probability that two objects of a type get the same description, (T,)."""
        prob = np.diff(self._ruler, prepend=0.0)
        first = np.r_[True, self.type_of_code[1:] != self.type_of_code[:-1]]
        prob[first] = self._ruler[first] - self.type_of_code[first]
        return np.bincount(self.type_of_code, weights=prob**2, minlength=len(self._labels))


@lru_cache(maxsize=8)
def make_descriptions(
    types: tuple[ObjectType, ...] | tuple[FurnitureType, ...],
) -> DescriptionTable:
    """Make the table of a prior's types once for all homes; it never changes."""
    return DescriptionTable(
        [each_type.label for each_type in types], [each_type.adjectives for each_type in types]
    )


def _list_combinations(categories: Adjectives) -> tuple[list[tuple[str, ...]], np.ndarray]:
    """List the adjective combinations of a type with their probabilities."""
    used = [tuple(words) for words in categories if len(words)]
    if not used:
        return [()], np.ones(1)
    combinations: list[tuple[str, ...]] = []
    probs: list[float] = []
    for size in range(1, len(used) + 1):
        subsets = list(itertools.combinations(used, size))
        for subset in subsets:
            share = 1.0 / (len(used) * len(subsets) * np.prod([len(words) for words in subset]))
            for words in itertools.product(*subset):
                combinations.append(words)
                probs.append(float(share))
    return combinations, np.array(probs)

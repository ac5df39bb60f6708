"""Text vectors of names, by an encoder of one's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from sgm.arrays.kept_rows import KeptRows
from sgm.messages import shorten
from sgm.names.aliases import AliasTable

# A function from n names to n vectors, of any width and length.
Encode = Callable[[list[str]], "np.typing.ArrayLike"]

_MOST_VECTORS = 5000  # of names that are kept; some encoders give a thousand numbers each
_SAMPLE = 300  # names of the table that the thresholds are measured on
_HOME = 100  # names that a home is taken to have
_FALSE = 0.02  # share of the names that nothing in such a home is called, and that find something
_FALSE_OFFERS = 0.1  # the same of offers
_LEAST = 0.3  # cosine under which nothing is alike, whatever is measured


class NameEncoder:
    """Compares names by the cosines of their vectors.

    Cosines of encoders have different scales, so that thresholds are measured: on names of the
    table of aliases that are neither the same thing nor kinds of one another. At the first one, 2 %
    of them find something among 100 others; at the second, 10 %.
    """

    def __init__(self, encode: Encode, table: AliasTable) -> None:
        """Use a function that gives vectors; anything else raises TypeError.

        Thresholds are measured on the names of the table when they are first used.
        """
        if not callable(encode):
            raise TypeError(
                f"encoder must be a function from names to vectors, got {shorten(encode)}. Give "
                "for example SentenceTransformer(name).encode."
            )
        self._encode = encode
        self._table = table
        self._vectors = KeptRows[str](_MOST_VECTORS)

    def compare(self, name: str, others: Sequence[str]) -> Sequence[float]:
        """Return the cosines of a name to others; raises ValueError for vectors that are none."""
        vectors = self._take([name, *others])
        return (vectors[1:] @ vectors[0]).tolist()

    @cached_property
    def thresholds(self) -> tuple[float, float]:
        """Cosines from which on two names mean the same, and one is offered for another."""
        table = self._table
        things = np.linspace(0, len(table.names) - 1, min(_SAMPLE, len(table.names))).astype(int)
        vectors = self._take([table.names[thing] for thing in things])
        cosines = vectors @ vectors.T
        for number, thing in enumerate(things.tolist()):
            near = {thing, *table.list_above(thing), *table.list_below(thing)}
            cosines[number, [other in near for other in things.tolist()]] = -1
        # Every third name or so, in the order of the table, is in the home of the others.
        home = cosines[:, :: max(len(things) // _HOME, 1)]
        best = np.sort(home.max(axis=1))
        least, related = np.quantile(best, [1 - _FALSE, 1 - _FALSE_OFFERS])
        return max(float(least), _LEAST), max(float(related), _LEAST)

    def _take(self, names: Sequence[str]) -> np.ndarray:
        """Return unit vectors; each name is encoded once, as long as it is kept."""
        return np.stack(self._vectors.take(names, self._compute))

    def _compute(self, new: list[str]) -> np.ndarray:
        vectors = np.asarray(self._encode(new), dtype=np.float64)
        if vectors.ndim != 2 or len(vectors) != len(new) or not np.isfinite(vectors).all():
            raise ValueError(
                f"encoder must give {len(new)} finite vectors of one width, got an array of "
                f"shape {vectors.shape}. Return one row for each name."
            )
        return vectors / np.maximum(np.sqrt((vectors**2).sum(axis=1, keepdims=True)), 1e-12)

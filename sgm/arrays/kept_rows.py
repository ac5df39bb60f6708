"""Rows that are computed once for each key, and kept: as many as one says."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Generic, TypeVar

import numpy as np

Key = TypeVar("Key", bound=Hashable)
_SPARE = 4  # times as many as are asked for at once are kept in any case


class KeptRows(Generic[Key]):
    """Rows by key, each computed when it is first asked for.

    Keys come from outside, such as the words of a question: without a bound, what is kept would
    grow as long as a process runs. Where it has too many, it begins anew. Threads may share it.
    """

    def __init__(self, most: int) -> None:
        """Keep so many."""
        self._most = most
        self._rows: dict[Key, np.ndarray] = {}

    def __len__(self) -> int:
        """How many are kept."""
        return len(self._rows)

    def take(
        self, keys: Sequence[Key], compute: Callable[[list[Key]], Iterable[np.ndarray]]
    ) -> list[np.ndarray]:
        """Return the row of each key; `compute` gives those of keys that are not kept."""
        rows, wanted = self._rows, list(dict.fromkeys(keys))
        new = [key for key in wanted if key not in rows]
        if len(rows) + len(new) > max(self._most, _SPARE * len(wanted)):
            rows, new = {}, wanted  # others: a thread may be reading those before
            self._rows = rows
        if new:
            rows.update(zip(new, compute(new), strict=True))
        return [rows[key] for key in keys]

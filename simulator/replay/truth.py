"""Where everything truly was at every step."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sgm.names.words import read_name


@dataclass(frozen=True)
class TruePlaces:
    """The objects of one home over T + 1 steps, in C slots.

    Attributes:
        furniture: index of the furniture node that holds the object of each slot, -1 for none,
            int32 (T + 1, C).
        code: its description, a row of `descriptions`, int32 (T + 1, C).
        descriptions: every description that came up.
    """

    furniture: np.ndarray
    code: np.ndarray
    descriptions: tuple[str, ...]

    @property
    def num_steps(self) -> int:
        """Steps after the first, T."""
        return len(self.furniture) - 1

    def list_there(self, step: int, furniture: int) -> list[str]:
        """List what is at a furniture node, each object once."""
        at = np.flatnonzero(self.furniture[step] == furniture)
        return sorted(self.descriptions[code] for code in self.code[step, at])

    def find(self, descriptions: Collection[str], num_furniture: int) -> np.ndarray:
        """Return where any object of some descriptions is, bool (T + 1, F)."""
        names = {read_name(text) for text in descriptions}
        codes = [code for name in names for code in self._codes.get(name, ())]
        is_there = np.zeros((len(self.furniture), num_furniture), dtype=bool)
        step, slot = np.nonzero(np.isin(self.code, codes) & (self.furniture >= 0))
        is_there[step, self.furniture[step, slot]] = True
        return is_there

    @cached_property
    def _codes(self) -> dict[tuple[str, ...], list[int]]:
        codes = defaultdict(list)
        for code, text in enumerate(self.descriptions):
            codes[read_name(text)].append(code)
        return codes

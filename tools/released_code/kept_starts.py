"""Homes in which noise never zeroes the place where an object begins, as in the released code."""

from __future__ import annotations

from typing import Any

import numpy as np

from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import PaperSource
from simulator.world.streams import Streams

_NEVER_ZEROED = 1.0  # above every share of weights that noise zeroes


class KeptStarts(PaperSource):
    """Homes of the released code's sizes; an object can always come back to where it was at t = 0.

    They have the random numbers of `PaperSource`: a home differs in these weights alone, and in
    what follows from them.
    """

    def make(self, streams: Streams) -> SampledHomes:
        """Sample homes at t = 0."""
        return _KeptStartsHomes(self.prior, self.home, streams)

    def describe(self) -> dict[str, Any]:
        """Return the rules, the checksum of the prior, and this one."""
        return {**super().describe(), "keeps_starts": True}


class _KeptStartsHomes(SampledHomes):
    def choose_objects(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Draw the objects of t = 0, and note where those of each description begin."""
        homes, types, places, codes = super().choose_objects()
        shape = (*self._row_of_code.shape, self.num_place_codes)
        self._is_start = np.zeros(shape, dtype=bool)  # (H, descriptions, P)
        self._is_start[homes, codes, places] = True
        return homes, types, places, codes

    def _draw_instance_noise(
        self, homes: np.ndarray, codes: np.ndarray, rows: np.ndarray, places: np.ndarray
    ) -> np.ndarray:
        uniform = np.array(super()._draw_instance_noise(homes, codes, rows, places))
        uniform[self._is_start[homes[rows], codes[rows], places], 0] = _NEVER_ZEROED
        return uniform

"""A detector that takes one thing for another, and knows how sure it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS
from simulator.world.homes import Homes
from simulator.world.sensing import ConstantMisses, Observation

_NUMBERS = 3  # per detection: its confidence, whether it is right, what it is taken for


@dataclass(frozen=True)
class Confidences(ConstantMisses):
    """Every detection says with which probability it is right, and is right that often.

    An object that is seen, as in `ConstantMisses`, is detected with a confidence c drawn from
    U(lowest, 1). With probability 1 - c it is taken for an object that is elsewhere in the home;
    where there is none, it is taken for what it is.

    Attributes:
        lowest: the lowest confidence.
    """

    lowest: float = 0.25

    def __post_init__(self) -> None:
        """Raise ValueError if the lowest confidence is not in [0, 1]."""
        if not 0 <= self.lowest <= 1:
            raise ValueError(
                f"lowest must lie in [0, 1], got {self.lowest}. Give the lowest confidence."
            )

    def observe(self, homes: Homes, looking: np.ndarray, furniture: np.ndarray) -> Observation:
        """Look; see `Sensing.observe`."""
        seen = ConstantMisses.observe(self, homes, looking, furniture)
        stream = homes.streams.rows("confidence", homes.home_num_slots * _NUMBERS)
        numbers = stream.claim(looking)
        row = np.searchsorted(looking, seen.seen_home)
        turn = np.arange(len(row)) - np.searchsorted(row, row)  # number within its home
        uniform = numbers.read(row, turn * _NUMBERS, _NUMBERS)
        confidence = self.lowest + (1 - self.lowest) * uniform[:, 0]
        code = seen.seen_code.copy()
        for wrong in np.flatnonzero(uniform[:, 1] >= confidence):
            home = seen.seen_home[wrong]
            places = homes.object_place[home]
            is_here = places // NUM_RELATIONS == furniture[row[wrong]]
            own = homes.object_code[home]
            elsewhere = np.setdiff1d(own[(places >= 0) & ~is_here], own[is_here])
            if len(elsewhere):
                code[wrong] = elsewhere[int(uniform[wrong, 2] * len(elsewhere))]
        return replace(seen, seen_code=code, seen_confidence=confidence)

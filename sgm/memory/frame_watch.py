"""Notices a look for every frame of a camera, which a memory takes for looks of their own."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from sgm.memory.clock import Clock
from sgm.memory.sighting import Sighting
from sgm.names.words import read_name

MOST_LOOKS = 10  # at one place in one time step; a search has three to five
_MOST_IN_A_ROW = 100  # looks at one place that show the same, step after step
_LONG_STEP = 30.0  # seconds: a camera that watches one place makes no faster steps
_ALIKE = 0.8  # share of the things of two looks that both show
_WHAT_TO_DO = (
    "Join the frames of a visit to one look, as sgm.eyes.LookBuilder does; let steps last minutes."
)


class LookPerFrameWarning(UserWarning):
    """A memory gets every frame of a camera as if it were a look."""


class FrameWatch:
    """Watches the looks of a memory, and warns once if they seem to be frames of a video."""

    def __init__(self) -> None:
        self._is_told = False
        self._furniture: int | None = None
        self._names: frozenset[tuple[str, ...]] = frozenset()
        self._num_alike = 0

    def note(
        self,
        furniture: int,
        place: str,
        seen: Sequence[Sighting],
        num_in_step: float,
        clock: Clock | None,
    ) -> None:
        """Take note of a look at a place, after looks there in this step, each by its coverage."""
        names = frozenset(read_name(sighting.description) for sighting in seen)
        both, any_of_them = len(names & self._names), len(names | self._names)
        is_alike = furniture == self._furniture and both >= _ALIKE * any_of_them
        self._num_alike = self._num_alike + 1 if is_alike else 1
        self._furniture, self._names = furniture, names
        if self._is_told:
            return
        is_slow = clock is not None and clock.step_seconds >= _LONG_STEP
        if num_in_step >= MOST_LOOKS:
            self._warn(
                f"looks must be few in a time step, got more than {MOST_LOOKS} at {place}: further "
                "ones of a step count if they show something new."
            )
        elif self._num_alike > _MOST_IN_A_ROW and not is_slow:
            lasting = "" if clock is None else f" of {clock.step_seconds:g} s"
            self._warn(
                f"looks must lie some time apart, got more than {_MOST_IN_A_ROW} in a row{lasting} "
                f"at {place} that show the same: if they are frames, each counts as a look."
            )

    def _warn(self, message: str) -> None:
        self._is_told = True
        warnings.warn(f"{message} {_WHAT_TO_DO}", LookPerFrameWarning, stacklevel=4)

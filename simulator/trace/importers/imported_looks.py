"""What became of recordings that a memory looked at: the memory, and what was left out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone

from sgm.checks import check_at_least
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory

_YEAR_OF_CLOCKS = 2000  # stamps before it are of a simulation and say no date


@dataclass(frozen=True, slots=True)
class TimeOptions:
    """How the times of a recording become steps of a memory.

    Attributes:
        step_seconds: length of a time step of the memory.
        utc_hours: of the home's local time; 2 means UTC+2.
    """

    step_seconds: float = 600.0
    utc_hours: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError if a number is out of range."""
        check_at_least(1, step_seconds=self.step_seconds)
        if not -24 <= self.utc_hours <= 24:
            raise ValueError(
                f"utc_hours must lie in -24 to 24, got {self.utc_hours}. Give the hours of the "
                "time zone."
            )

    def to_local(self, seconds: float) -> datetime | None:
        """Return the local time of a time of Unix; None for a simulation's."""
        try:
            date = datetime.fromtimestamp(seconds, timezone.utc) + timedelta(hours=self.utc_hours)
        except (OverflowError, OSError, ValueError):
            return None
        return None if date.year < _YEAR_OF_CLOCKS else date.replace(tzinfo=None)

    def make_clock(self, seconds: float) -> Clock | None:
        """Return the clock of a memory that begins at a time of Unix; None for a simulation's."""
        start = self.to_local(seconds)
        return None if start is None else Clock(start.replace(microsecond=0), self.step_seconds)


@dataclass(frozen=True, slots=True)
class ImportedLooks:
    """A memory that has seen a recording, how many looks that were, and what was counted."""

    memory: SceneGraphMemory
    num_looks: int
    counts: Counter[str]

    def summarise(self) -> str:
        """Say in two lines what was read and what was left out."""
        counts = ", ".join(f"{number} {name}" for name, number in sorted(self.counts.items()))
        return (
            f"{self.num_looks} looks, {len(self.memory.descriptions)} things, "
            f"{self.memory.num_furniture} pieces of furniture, {self.memory.time} time steps\n"
            f"read: {counts}"
        )

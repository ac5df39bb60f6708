"""The rules of the abstract dynamics, and their defaults."""

from __future__ import annotations

from dataclasses import dataclass

from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from simulator.world.dynamics import Dynamics


@dataclass(frozen=True, slots=True)
class AbstractRules(Dynamics):
    """The numbers of `AbstractDynamics`.

    Attributes:
        start_time: local date and time of step 0.
        step_seconds: length of a step.
        min_moves, max_moves: bounds of the share of objects that activities move in a step, drawn
            on a logarithmic scale.
    """

    start_time: str = "2024-05-06T00:00"
    step_seconds: float = DEFAULT_STEP_SECONDS
    min_moves: float = 0.01
    max_moves: float = 0.2

    def __post_init__(self) -> None:
        """Check every value.

        Raises:
            ValueError: if one is out of range; it is named.
        """
        self.clock  # noqa: B018 - checks start_time and step_seconds
        if not 0 < self.min_moves <= self.max_moves <= 1:
            raise ValueError(
                "min_moves must be above 0 and at most max_moves, which is at most 1, got "
                f"{self.min_moves} and {self.max_moves}. Correct the bounds."
            )

    @property
    def clock(self) -> Clock:
        """What time it is at every step."""
        return Clock.of_rules(self.start_time, self.step_seconds)

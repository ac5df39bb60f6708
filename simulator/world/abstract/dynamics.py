"""The abstract dynamics: its rules, and their defaults."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from simulator.world.dynamics import Dynamics

if TYPE_CHECKING:
    from simulator.world.abstract.life import AbstractLife
    from simulator.world.sampled_homes import SampledHomes


@dataclass(frozen=True, slots=True)
class AbstractDynamics(Dynamics):
    """Things have usual places and are used in activities, all drawn without regard to names.

    Every object has a usual place, some have a second one. An activity takes its things from
    wherever they are through one to three places, for some time each, about its hour of the day;
    then they go back to a usual place, or stay. In some homes nearly everything is used and in
    others little, things of a name are kept together or not, a few places hold nearly all or each
    holds its share: what differs between homes is drawn for each of them within wide bounds
    (`simulator.world.abstract.ways`). So what can be learnt in many of them is how to follow
    things, not what things are. Nothing comes or goes.

    Attributes:
        start_time: local date and time of step 0.
        step_seconds: length of a step.
        min_moves, max_moves: bounds of the share of objects that activities move in a step, drawn
            on a logarithmic scale.
    """

    keeps_slots: ClassVar[bool] = True

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

    @classmethod
    def start(
        cls, homes: SampledHomes, members: np.ndarray, rules: Sequence[AbstractDynamics]
    ) -> AbstractLife:
        """Draw usual places and activities, and live up to the first step."""
        from simulator.world.abstract.life import AbstractLife

        return AbstractLife(homes, members, rules)

"""How homes change: what rules of one's own must offer, and the rules by name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sgm.memory.clock import Clock
from simulator.world.parts import Part, Registry
from simulator.world.sampled_state import SampledState

if TYPE_CHECKING:
    from typing_extensions import Self


class Dynamics(Part, ABC):
    """Rules by which a home changes; a frozen dataclass of their numbers.

    The homes of one lockstep group may have different dynamics. Those of one class are evolved
    together, by what `start` returns.
    """

    __slots__ = ()

    # Whether an object has its slot for good, also while it is out of the home for some steps.
    keeps_slots: ClassVar[bool] = False
    # Whether every move is drawn from the rows of T, whatever the time: then `ceiling` is exact.
    follows_transitions: ClassVar[bool] = False
    # Whether `Life.sample_hours` says how a home may live on: then `schedule_oracle` plays.
    has_schedules: ClassVar[bool] = False

    @property
    def clock(self) -> Clock | None:
        """What time it is at every step; None where no time of day means anything."""
        return None

    @classmethod
    @abstractmethod
    def start(cls, homes: SampledState, members: np.ndarray, rules: Sequence[Self]) -> Life:
        """Begin the life of some homes of a group, whose objects have just been drawn.

        It may put them elsewhere. Random numbers come from `homes.streams`, from rows of purposes
        of its own that are taken for the members alone, as wide as each home needs: so a home does
        not depend on those beside it.

        Args:
            homes: the group, at t = 0.
            members: the homes with dynamics of this class, ascending, (n,).
            rules: of each of them, (n,).
        """


class Life(ABC):
    """The homes of a group that have dynamics of one class, as they live on."""

    @abstractmethod
    def step(self) -> None:
        """Let one time step pass in these homes and in no others.

        `object_place` and what else `SampledState` says of objects change; `object_moved` is False
        everywhere before, and becomes True where an object has moved to other furniture.
        """

    def skip(self, num_steps: int) -> None:
        """Let time steps pass without a look; `object_moved` may say anything."""
        for _ in range(num_steps):
            self.step()

    @abstractmethod
    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return where objects of descriptions go, (n,), (n,) -> float32 (n, P).

        What oracles know and rankings are measured by: the homes are some of these. A row sums to
        one, or to zero for a description that no object has had.
        """

    def sample_hours(self, num_hours: int) -> np.ndarray:
        """Return the furniture of every object in a life that starts like this one, hour by hour.

        Args:
            num_hours: T; hour 0 is step 0.

        Returns:
            int16 (H, T, C), -1 out of the home; what it says of homes of other lives means nothing.
        """
        raise NotImplementedError(f"{type(self).__name__} has no schedules")


DYNAMICS = Registry(
    Dynamics,  # type: ignore[type-abstract]
    "dynamics",
    paper="simulator.world.paper_dynamics.PaperDynamics",
    routine="simulator.world.routine.dynamics.RoutineDynamics",
    sessions="simulator.world.sessions.dynamics.SessionDynamics",
)

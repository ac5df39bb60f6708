"""The routine dynamics: residents with habits, by the rules of `RoutineRules`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simulator.world.routine.rules import RoutineRules
from simulator.world.sampled_state import SampledState

if TYPE_CHECKING:
    from simulator.world.routine.life import RoutineLife


class RoutineDynamics(RoutineRules):
    """One to four residents with habits, who take things, use them, and put them back or not.

    Every resident has a role, hours and an own set of things for each occasion of the day. On
    each day an occasion takes place or is omitted, at its hour with a drift that lasts for days
    and a jitter of the day. When it begins, its things are taken from wherever they are to the
    place where this resident does such things; when it ends, each is left there or put back to
    its usual place, now and then to its second one, seldom to a new one for good. Those who leave
    the home carry things out and bring them back. Washing up collects what cooking and eating
    have left, cleaning puts everything back, and in the evening a resident tidies up a part. Things
    that no resident uses never move.

    Usual places are drawn from T^i, the home's own noisy prior (`Transitions`). The life of a home
    does not depend on the length of its steps: they say only when one looks. It begins
    `warm_up_days` before the first step, so that the first look finds things lying about.

    All numbers are assumptions in round figures. They were chosen by eye so that homes of 48
    objects behave within the spread of five recorded households; none is fitted to one of them,
    and `results/realism.md` holds other homes against the five.
    """

    __slots__ = ()

    keeps_slots: ClassVar[bool] = True
    has_schedules: ClassVar[bool] = True

    @classmethod
    def start(
        cls, homes: SampledState, members: np.ndarray, rules: Sequence[RoutineDynamics]
    ) -> RoutineLife:
        """Draw residents, habits and usual places, and live up to the first step."""
        from simulator.world.routine.life import RoutineLife  # loads the kinds of activity

        return RoutineLife(homes, members, rules)

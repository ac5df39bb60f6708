"""The abstract dynamics: activities drawn without regard to names, by `AbstractRules`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simulator.world.abstract.rules import AbstractRules
from simulator.world.sampled_state import SampledState

if TYPE_CHECKING:
    from simulator.world.abstract.life import AbstractLife


class AbstractDynamics(AbstractRules):
    """Things have usual places and are used in activities, all drawn without regard to names.

    Every object has a usual place, some have a second one. An activity takes its things from
    wherever they are through one to three places, for some time each, about its hour of the day;
    then they go back to a usual place, or stay. In some homes nearly everything is used and in
    others little, things of a name are kept together or not, a few places hold nearly all or each
    holds its share: what differs between homes is drawn for each of them within wide bounds
    (`simulator.world.abstract.home_habits`). So what can be learnt in many of them is how to follow
    things, not what things are. Nothing comes or goes.
    """

    __slots__ = ()

    keeps_slots: ClassVar[bool] = True

    @classmethod
    def start(
        cls, homes: SampledState, members: np.ndarray, rules: Sequence[AbstractDynamics]
    ) -> AbstractLife:
        """Draw usual places and activities, and live up to the first step."""
        from simulator.world.abstract.life import AbstractLife

        return AbstractLife(homes, members, rules)

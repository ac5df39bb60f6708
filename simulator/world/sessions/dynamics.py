"""The session dynamics: things move in sessions of residents, along ways, and lie still between."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simulator.world.sampled_state import SampledState
from simulator.world.sessions.rules import SessionRules

if TYPE_CHECKING:
    from simulator.world.sessions.life import SessionLife


class SessionDynamics(SessionRules):
    """A resident is there now and then and uses things; between sessions hardly anything moves.

    A session is of one kind of activity (cooking, eating, washing up, reading, ...), at a spot of
    its own, and uses things of that kind, some of them again and again. When a thing is used, one
    of these happens, with shares that are drawn for each type in each home:

    - it is taken somewhere and *put back* within minutes;
    - it *stays* where it was put until it is used again: then it goes back or on;
    - it is *handed on* to the next place of its way; what is used up leaves the home there;
    - it gets a *new usual place*, for good.

    Where it is taken to is the next place of its way, or the spot of the session. A *way* is where
    things of a kind go from each place: to one to three others, drawn for each home, mostly to
    where the activity is done and to where such things are kept. Outings take what is carried along
    out of the home. What was used up may come back days later. Activities, what they need and where
    they are done are those of the routine (`simulator.world.routine.activity_kinds`).

    Rates are per hour and day: a life does not depend on the length of its steps. All numbers are
    assumptions in round figures; `simulator.world.mixture.lived_in_homes` draws them for each home.
    """

    __slots__ = ()

    keeps_slots: ClassVar[bool] = True
    has_schedules: ClassVar[bool] = True

    @classmethod
    def start(
        cls, homes: SampledState, members: np.ndarray, rules: Sequence[SessionDynamics]
    ) -> SessionLife:
        """Draw habits and usual places, and live up to the first step."""
        from simulator.world.sessions.life import SessionLife  # loads the kinds of activity

        return SessionLife(homes, members, rules)

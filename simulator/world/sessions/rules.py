"""The rules by which homes with sessions live, with their defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from sgm.checks import check_shares
from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from simulator.world.dynamics import Dynamics

# The least and the most that each number may be, but for shares.
_BOUNDS = {
    "sessions_per_day": (0, 100),
    "session_minutes": (0.1, 1440),
    "moves_per_hour": (0, 5000),
    "hour_spread": (0, 24),
    "use_minutes": (0.01, 1440),
    "way_spread": (0, 4),
    "favourites": (0, 4),
    "manner_spread": (0.01, 100),
    "out_hours": (0.01, 72),
    "work_hour": (0, 24),
    "work_hours": (0.01, 24),
    "work_spread": (0, 12),
    "restock_days": (0.01, 1000),
    "gathering": (0, 100),
    "warm_up_days": (0, 365),
    "outlook_days": (1, 365),
}


@dataclass(frozen=True, slots=True)
class SessionRules(Dynamics):
    """The numbers of `SessionDynamics`.

    Attributes:
        start_time: local date and time of step 0.
        step_seconds: length of a step.
        sessions_per_day: how many on average.
        session_minutes: mean length.
        moves_per_hour: uses of things per hour of a session.
        idle_share: share of the uses that happen outside of sessions, at any hour.
        regular_share: share of the kinds of activity that have a usual hour; others are at any hour
            from 7 to 23.
        hour_spread: standard deviation of the hour of those that have, in hours.
        away_share: share of the sessions for which a resident leaves the home.
        out_hours: mean length of these.
        work_share: share of the workdays on which a resident goes to work, besides.
        work_hour: when, in hours after midnight.
        work_hours: mean length of a day at work.
        work_spread: standard deviation of both, in hours.
        tidy_share: share of the things used in a session that are put back when it ends.
        again_share: how often what is used was used just before in the same session.
        back_share, stay_share, handed_share, resettled_share: mean shares of what happens when a
            thing is used; they are divided by their sum.
        manner_spread: how alike types are in that: their shares have a Dirichlet distribution with
            so many counts.
        use_minutes: mean time until what is put back is back.
        way_share: how often a thing goes on along its way and not to the spot of the session.
        way_spread: standard deviation of the logarithm of how readily ways lead to a place.
        way_next: weight of the second place of a way, as a share of the first one's; of the third,
            as a share of the second one's.
        return_share: how often what is used away from its usual place goes back there.
        static_share: share of the things that are never used.
        favourites: standard deviation of the logarithm of how often things are used.
        carried_share: how often outings take along what people carry, and as many other things;
            `carried.csv` of the routine says how often each goes.
        consumed_share: how often what is handed on is used up, and leaves the home.
        restocked_share: share of what was used up that comes back.
        restock_days: mean time until then.
        missing_share: share of the things that come into the home later than it begins.
        gathering: how much things are kept where others are, see `draw_own_places`.
        second_place_share: share of the things with a second place, which a return may lead to.
        warm_up_days: lived before the first step.
        outlook_days: lived in a copy of the home to find where things are in the long run.
    """

    start_time: str = "2024-05-06T00:00"
    step_seconds: float = DEFAULT_STEP_SECONDS
    sessions_per_day: float = 6.0
    session_minutes: float = 30.0
    moves_per_hour: float = 20.0
    idle_share: float = 0.05
    regular_share: float = 0.6
    hour_spread: float = 1.0
    away_share: float = 0.15
    out_hours: float = 4.0
    work_share: float = 0.0
    work_hour: float = 8.5
    work_hours: float = 9.0
    work_spread: float = 0.5
    tidy_share: float = 0.3
    again_share: float = 0.4
    back_share: float = 0.35
    stay_share: float = 0.35
    handed_share: float = 0.25
    resettled_share: float = 0.02
    manner_spread: float = 2.0
    use_minutes: float = 5.0
    way_share: float = 0.6
    way_spread: float = 1.0
    way_next: float = 0.4
    return_share: float = 0.4
    static_share: float = 0.2
    favourites: float = 1.0
    carried_share: float = 0.5
    consumed_share: float = 0.02
    restocked_share: float = 0.7
    restock_days: float = 3.0
    missing_share: float = 0.05
    gathering: float = 3.0
    second_place_share: float = 0.1
    warm_up_days: int = 1
    outlook_days: int = 14

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range; names it."""
        self.clock  # noqa: B018 - checks start_time and step_seconds
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_share") or field.name == "way_next":
                check_shares(**{field.name: value})
            if field.name in _BOUNDS:
                low, high = _BOUNDS[field.name]
                if not (math.isfinite(value) and low <= value <= high):
                    raise ValueError(
                        f"{field.name} must lie in {low} to {high}, got {value}. Correct it."
                    )
        if not self.back_share + self.stay_share + self.handed_share + self.resettled_share > 0:
            raise ValueError(
                "back_share, stay_share, handed_share and resettled_share must not all be 0, got "
                "0 for each. Raise one."
            )

    @property
    def clock(self) -> Clock:
        """What time it is at every step."""
        return Clock.of_rules(self.start_time, self.step_seconds)

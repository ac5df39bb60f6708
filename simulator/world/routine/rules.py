"""The rules by which residents live, and the occasions of their days, with their defaults."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from sgm.checks import check_shares
from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from simulator.world.dynamics import Dynamics
from simulator.world.routine.activity_kinds import load_kinds

if TYPE_CHECKING:
    from typing_extensions import Self


ROLES = ("works away", "works at home", "stays at home")


@dataclass(frozen=True, slots=True)
class Occasion:
    """Something that a resident does at most once a day.

    Attributes:
        name: such as "breakfast"; each once.
        kind: kind of activity.
        weekday_hour: usual local time of its start from Monday to Friday, 4 to 28 (4 at night).
        weekend_hour: likewise on Saturday and Sunday.
        minutes: usual length.
        weekday_share: share of the weekdays on which it is done.
        weekend_share: likewise of the weekend's days.
        after: the occasion that it follows at once where that is done, "" for none.
        role: one of `ROLES` whose people alone do it, "" for all.
    """

    name: str
    kind: str
    weekday_hour: float
    weekend_hour: float
    minutes: float
    weekday_share: float
    weekend_share: float
    after: str = ""
    role: str = ""


# All numbers are assumptions, in round figures: waking at seven, an hour and a half later at the
# weekend, three meals that are cooked and cleared away most of the time, work from nine to six.
DEFAULT_OCCASIONS = (
    Occasion("morning wash", "grooming", 7.0, 8.5, 20, 0.95, 0.90),
    Occasion("morning dress", "dressing", 7.3, 8.9, 10, 0.95, 0.85, after="morning wash"),
    Occasion("make breakfast", "cooking", 7.5, 9.0, 15, 0.75, 0.80, after="morning dress"),
    Occasion("breakfast", "eating", 7.7, 9.2, 20, 0.80, 0.85, after="make breakfast"),
    Occasion("clear breakfast", "washing up", 8.1, 9.6, 15, 0.50, 0.60, after="breakfast"),
    Occasion("job", "leaving", 8.5, 10.0, 540, 0.90, 0.05, role="works away"),
    Occasion("desk, morning", "work", 9.0, 10.5, 180, 0.85, 0.10, role="works at home"),
    Occasion("chores", "cleaning", 10.0, 11.0, 45, 0.30, 0.50),
    Occasion("make lunch", "cooking", 12.0, 13.0, 30, 0.60, 0.70),
    Occasion("lunch", "eating", 12.5, 13.5, 30, 0.85, 0.85, after="make lunch"),
    Occasion("clear lunch", "washing up", 13.1, 14.1, 15, 0.50, 0.50, after="lunch"),
    Occasion("desk, afternoon", "work", 13.5, 14.5, 210, 0.85, 0.10, role="works at home"),
    Occasion("errand", "leaving", 15.0, 14.5, 90, 0.25, 0.50),
    Occasion("snack", "eating", 16.0, 16.0, 20, 0.50, 0.50),
    Occasion("game", "play", 17.0, 15.5, 60, 0.30, 0.50),
    Occasion("make dinner", "cooking", 18.2, 18.5, 45, 0.70, 0.70),
    Occasion("dinner", "eating", 19.0, 19.2, 40, 0.90, 0.85, after="make dinner"),
    Occasion("clear dinner", "washing up", 19.8, 20.0, 20, 0.60, 0.60, after="dinner"),
    Occasion("guests", "eating", 20.0, 19.5, 120, 0.05, 0.20),
    Occasion("television", "play", 20.3, 20.5, 75, 0.50, 0.60),
    Occasion("book", "reading", 21.3, 21.5, 45, 0.40, 0.40),
    Occasion("evening wash", "grooming", 22.3, 22.8, 15, 0.90, 0.90),
    Occasion("undress", "dressing", 22.6, 23.2, 10, 0.80, 0.80, after="evening wash"),
)


def check_occasions(occasions: tuple[Occasion, ...]) -> None:
    """Raise ValueError if there is no occasion, a name occurs twice, or a value is out of range."""
    names = [occasion.name for occasion in occasions]
    if not names or len(set(names)) < len(names):
        raise ValueError(
            f"occasions must be one or more with different names, got {names}. Name each once."
        )
    for number, occasion in enumerate(occasions):
        rules = {
            f"kind must be one of {', '.join(load_kinds())}": occasion.kind in load_kinds(),
            f"role must be one of {', '.join(ROLES)}, or empty": occasion.role in ("", *ROLES),
            "after must be an occasion that stands before it": (
                occasion.after in ("", *names[:number])
            ),
            "hours must lie in 4 to 28": (
                4 <= occasion.weekday_hour < 28 and 4 <= occasion.weekend_hour < 28
            ),
            "minutes must be above 0": occasion.minutes > 0,
            "shares must lie in [0, 1]": (
                0 <= occasion.weekday_share <= 1 and 0 <= occasion.weekend_share <= 1
            ),
        }
        for rule, holds in rules.items():
            if not holds:
                raise ValueError(f"{rule}, got {occasion}. Correct this occasion.")


@dataclass(frozen=True, slots=True)
class RoutineRules(Dynamics):
    """The numbers of `RoutineDynamics`.

    Attributes:
        start_time: local date and time of step 0.
        step_seconds: length of a step.
        min_residents, max_residents: bounds of their number, every one equally likely.
        away_share: share of the residents who work away from home.
        home_office_share: share of those who work at home; the others stay at home.
        occasions: what may happen in a day.
        person_spread_hours: standard deviation of how much later a resident does everything.
        habit_spread_hours: likewise for each of a resident's occasions.
        omission_spread: a resident's own share of days differs from that of an occasion by up to
            so much.
        drift_hours: standard deviation of how much later than usual a resident lives for some days.
        drift_days: for how long: the drifts of days so far apart have a correlation of 1 / e.
        jitter_hours: standard deviation of an occasion's time from day to day.
        max_things_share: a resident usually takes one thing to so many for an occasion, as a share
            of the home's objects: where there is more, more is used.
        together: how often a thing that is kept apart from a resident's other things for a kind of
            activity is passed over for it.
        min_use, max_use: bounds of how often each of them is taken.
        static_share: share of the objects that no resident uses.
        own_spot_share: how often a resident has an own place for a kind of activity.
        elsewhere_share: how often an activity is done elsewhere than usual.
        extra_share: how often one more thing is taken than usual.
        left_share: share of a resident's things that are usually left where they were used.
        left_habit: how often what is usually left is left, and what is not is put back.
        gathering: how much things are kept where others are: a place with n things has the weight
            1 + n gathering, times its weight in T^i.
        second_place_share: share of the objects that have a second place.
        second_share: how often such an object is put there.
        new_share: how often an object gets a new usual place when it is put back.
        collect_share: how much of what lies about is collected for washing up, or by cleaning.
        tidy_share: how much of what lies about is put back in the evening.
        tidy_hour: when that is.
        warm_up_days: days lived before the first step.
        outlook_days: days lived in a copy of the home to find where things are in the long run.
        carry_share: how often residents who leave the home take along what people carry (keys,
            phones, bags: `carried.csv`, each as often as it says) and what is theirs of it, beside
            the things of an errand; 0 for never.
        carries_anything: whether as many other things are carried instead, whatever they are
            called: homes in which no name tells what leaves.
    """

    start_time: str = "2024-05-06T00:00"
    step_seconds: float = DEFAULT_STEP_SECONDS
    min_residents: int = 1
    max_residents: int = 4
    away_share: float = 0.5
    home_office_share: float = 0.2
    occasions: tuple[Occasion, ...] = DEFAULT_OCCASIONS
    person_spread_hours: float = 0.75
    habit_spread_hours: float = 0.5
    omission_spread: float = 0.2
    drift_hours: float = 0.5
    drift_days: float = 7.0
    jitter_hours: float = 0.25
    max_things_share: float = 0.12
    together: float = 0.9
    min_use: float = 0.5
    max_use: float = 1.0
    static_share: float = 0.05
    own_spot_share: float = 0.1
    elsewhere_share: float = 0.02
    extra_share: float = 0.2
    left_share: float = 0.5
    left_habit: float = 0.9
    gathering: float = 3.0
    second_place_share: float = 0.1
    second_share: float = 0.1
    new_share: float = 0.002
    collect_share: float = 0.9
    tidy_share: float = 0.7
    tidy_hour: float = 22.0
    warm_up_days: int = 3
    outlook_days: int = 28
    carry_share: float = 0.0
    carries_anything: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range; names it."""
        self.clock  # noqa: B018 - checks start_time and step_seconds
        check_occasions(self.occasions)
        if not 1 <= self.min_residents <= self.max_residents <= 4:
            raise ValueError(
                "residents must be 1 to 4, min_residents at most max_residents, got "
                f"{self.min_residents} to {self.max_residents}. Correct the bounds."
            )
        if self.away_share + self.home_office_share > 1:
            raise ValueError(
                "away_share and home_office_share must add up to at most 1, got "
                f"{self.away_share + self.home_office_share:g}. Lower one."
            )
        if not self.min_use <= self.max_use:
            raise ValueError(
                f"min_use must be at most max_use, got {self.min_use} and {self.max_use}. "
                "Swap them."
            )
        least = {"warm_up_days": 1, "outlook_days": 1, "drift_days": 0.01}
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith(("_share", "_use", "_habit")):
                check_shares(**{field.name: value})
            if field.name.endswith(("_hours", "_spread")) and not 0 <= value <= 24:
                raise ValueError(
                    f"{field.name} must lie in 0 to 24 hours, got {value}. Correct it."
                )
            if field.name in least and not least[field.name] <= value < math.inf:
                raise ValueError(
                    f"{field.name} must be at least {least[field.name]}, got {value}. Raise it."
                )
        if not 4 <= self.tidy_hour < 28:
            raise ValueError(f"tidy_hour must lie in 4 to 28, got {self.tidy_hour}. Take 22.")

    @property
    def clock(self) -> Clock:
        """What time it is at every step."""
        return Clock.of_rules(self.start_time, self.step_seconds)

    def describe(self) -> dict[str, Any]:
        """Return the fields as JSON values; those of carrying only where something is carried.

        So homes in which nothing is are described as they were before anything could be.
        """
        described = Dynamics.describe(self)
        if self.carry_share == 0:
            del described["carry_share"], described["carries_anything"]
        return described

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Make the rules from what `describe` returned."""
        fields = dict(data)
        if "occasions" in fields:
            fields["occasions"] = tuple(Occasion(**occasion) for occasion in fields["occasions"])
        return cls(**fields)

"""The occasions of a resident's day: what is done at about what time, and how regularly."""

from __future__ import annotations

from dataclasses import dataclass

from simulator.world.routine.activity_kinds import load_kinds

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

"""Local time: where in the week the time steps of a home lie, and how many until a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from sgm.arrays.week import DAY_SECONDS, HOUR_SECONDS
from sgm.checks import is_finite
from sgm.messages import shorten
from sgm.schema import MAX_TIME

DEFAULT_STEP_SECONDS = HOUR_SECONDS
# A wall clock that is wrong is wrong by weeks or years (an empty battery, day and month exchanged);
# a robot that was switched off comes back within a month.
MAX_JUMP = timedelta(days=31)
# Farther ahead no question makes sense: it was seconds for steps, or a slip.
MOST_AHEAD = timedelta(days=366)


@dataclass(frozen=True, slots=True)
class Clock:
    """What time it is at every time step of a home, step t at `start` + t `step_seconds`.

    The clock runs evenly: there is no daylight saving time.

    Attributes:
        start: local date and time of step 0, without a time zone.
        step_seconds: length of a step.
    """

    start: datetime
    step_seconds: float = DEFAULT_STEP_SECONDS

    def __post_init__(self) -> None:
        """Raise TypeError or ValueError unless they are local time and a number above 0."""
        if not isinstance(self.start, datetime):
            raise TypeError(
                f"start must be a datetime, got {shorten(self.start)}. Write datetime(2026, 11, "
                "16, 7, 30), or datetime.now()."
            )
        if self.start.tzinfo is not None:
            raise ValueError(
                "start must be local time, got the time zone of "
                f"{shorten(self.start.isoformat())}. Leave the zone out."
            )
        seconds = self.step_seconds
        if isinstance(seconds, bool) or not isinstance(seconds, (int, float)):
            raise TypeError(f"step_seconds must be a number, got {shorten(seconds)}. Take 3600.")
        if not (is_finite(seconds) and seconds > 0):
            raise ValueError(
                f"step_seconds must be a number > 0, got {shorten(seconds)}. Take 3600."
            )

    @classmethod
    def of_rules(cls, start_time: str, step_seconds: float) -> Clock:
        """Make the clock of rules, in ISO 8601 and seconds; raises ValueError if they are none."""
        try:
            return cls(datetime.fromisoformat(start_time), step_seconds)
        except (TypeError, ValueError) as error:
            raise ValueError(
                "start_time and step_seconds must be a date and time and a number of seconds, got "
                f"{shorten(start_time)} and {shorten(step_seconds)}: {error}"
            ) from None

    @property
    def row(self) -> tuple[float, float]:
        """Seconds from Monday 00:00 to step 0, and seconds per step: a row of `clock` arrays."""
        midnight = self.start.replace(hour=0, minute=0, second=0, microsecond=0)
        since_midnight = (self.start - midnight).total_seconds()
        return self.start.weekday() * DAY_SECONDS + since_midnight, float(self.step_seconds)

    def get_date(self, time: int) -> datetime | None:
        """Return when a time step begins; None beyond the year 9999."""
        return self.get_date_after(time * self.step_seconds)

    def get_date_after(self, seconds: float) -> datetime | None:
        """Return the date and time so many seconds after step 0; None beyond the calendar."""
        try:
            return self.start + timedelta(seconds=seconds)
        except (OverflowError, ValueError):
            return None

    def shift(self, seconds: float) -> Clock:
        """Return the clock of a home that starts later; raises ValueError beyond the calendar."""
        try:
            return Clock(self.start + timedelta(seconds=seconds), self.step_seconds)
        except OverflowError:
            raise ValueError(
                f"time must be a date before the year 10000, got {seconds:g} s after {self.start}. "
                "Count time_s in seconds from start."
            ) from None

    def get_time(self, step: int) -> datetime:
        """Return the date and time of a time step; raises ValueError beyond the calendar."""
        return self.shift(step * self.step_seconds).start

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, from which `from_json` makes the same clock."""
        return {"start": self.start.isoformat(), "step_seconds": self.step_seconds}

    @classmethod
    def from_json(cls, data: Any) -> Clock:
        """Read JSON values; raises KeyError, TypeError or ValueError if they are none."""
        return cls(datetime.fromisoformat(data["start"]), data["step_seconds"])


def make_clock_rows(clocks: Sequence[Clock | None]) -> np.ndarray | None:
    """Return the rows of homes, float64 (H, 2), nan for those without; None if all are without."""
    if all(clock is None for clock in clocks):
        return None
    unknown = (math.nan, math.nan)
    return np.array([unknown if clock is None else clock.row for clock in clocks])


def check_ahead(
    num_steps: int, now: int, clock: Clock | None, name: str, most: timedelta, remedy: str
) -> None:
    """Check how far a time is after the present step, by a clock if there is one.

    Raises:
        ValueError: if that is more than `most`.
    """
    if clock is not None and num_steps * clock.step_seconds > most.total_seconds():
        days = num_steps * clock.step_seconds / DAY_SECONDS
        raise ValueError(
            f"{name} must be at most {most.days} days after the present step, got {days:.0f} days "
            f"at {clock.get_time(now)}. {remedy}"
        )


def count_steps(time: datetime | int, now: int, clock: Clock | None, name: str = "time") -> int:
    """Return how many steps it is until a time: to the last step that has begun by then.

    Raises:
        ValueError: if it is no time step and no date and time by the clock, has passed, is too far
            ahead, or there is no clock.
    """
    if isinstance(time, datetime):
        if clock is None:
            raise ValueError(
                "memory must have a clock for a date and time, got none. Give a time step, or make "
                "the memory with a clock."
            )
        if time.tzinfo is not None:
            raise ValueError(
                f"{name} must be local time, got the time zone of {time.isoformat()}. Leave "
                "the zone out."
            )
        seconds = (time - clock.start).total_seconds()
        num_steps = math.floor(seconds / clock.step_seconds + 1e-9) - now
    elif isinstance(time, (int, np.integer)) and not isinstance(time, bool):
        num_steps = int(time) - now
    else:
        raise ValueError(
            f"{name} must be a datetime or a time step, got {shorten(time)}. Write for example "
            "datetime(2026, 11, 16, 18, 30)."
        )
    if not 0 <= num_steps <= MAX_TIME - now:
        present: Any = f"time step {now}"
        if clock is not None and isinstance(time, datetime):
            present = clock.get_time(now)
        raise ValueError(
            f"{name} must not be before the present step, nor after step {MAX_TIME}, got {time} "
            f"at {present}. Time only goes forward; history tells the past."
        )
    return num_steps

"""Time steps until a time."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from sgm.memory.clock import Clock
from sgm.messages import shorten

MAX_TIME = 2**31 - 2  # time stamps are 32-bit integers
# A wall clock that is wrong is wrong by weeks or years (an empty battery, day and month exchanged);
# a robot that was switched off comes back within a month.
MAX_JUMP = timedelta(days=31)


def check_jump(num_steps: int, now: int, clock: Clock) -> None:
    """Check that time passes by no more than a robot's clock is believed at once.

    Raises:
        ValueError: if it is more than `MAX_JUMP`.
    """
    if num_steps * clock.step_seconds > MAX_JUMP.total_seconds():
        raise ValueError(
            f"time must be at most {MAX_JUMP.days} days after the present step, got "
            f"{clock.get_time(now + num_steps)} at {clock.get_time(now)}. Check the clock of the "
            "robot; if it is right, say accept_jump=True."
        )


def count_steps(time: datetime | int, now: int, clock: Clock | None, name: str = "time") -> int:
    """Return how many steps it is until a time: to the last step that has begun by then.

    Args:
        time: a date and time by the clock, or a time step.
        now: the present step.
        clock: of the home; None if it has none.
        name: of the argument, for the message.

    Raises:
        ValueError: if it is something else, has passed, is too far ahead, or there is no clock.
    """
    if isinstance(time, datetime):
        if clock is None:
            raise ValueError(
                "memory must have a clock for a date and time, got none. Make it with "
                "SceneGraphMemory(clock=Clock(datetime.now(), step_seconds=600))."
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
